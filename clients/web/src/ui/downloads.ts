import { type FinishedRun, finishedFileUrl } from '../server/finished';
import { element } from './dom';

/** Files that people take away, and what they are called on the page. */
const FILES: Readonly<Record<string, string>> = {
  'model.ply': 'Model (PLY)',
  'trajectory.tum': 'Trajectory (TUM)',
  'report.json': 'Report (JSON)',
  'recording.mcap': 'Recording (MCAP)',
};

/** Links to the files that a finished run left. */
export function finishedLinks(run: FinishedRun): HTMLAnchorElement[] {
  const present = Object.entries(FILES).filter(([file]) => run.files.includes(file));
  return present.map(([file, label]) =>
    element(
      'a',
      { href: finishedFileUrl(run, file), download: `${run.run}-${file}`, class: 'download' },
      label,
    ),
  );
}

/** Lets the browser save what the page made or fetched. */
export function saveBlob(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  element('a', { href: address, download: name }).click();
  URL.revokeObjectURL(address);
}

/** The time as part of a file's name: `2026-03-01T12-30-05`. */
export function timeForName(): string {
  return new Date().toISOString().replaceAll(':', '-').slice(0, 19);
}
