// Tests and their helpers are TypeScript, which Node 18 cannot run: they are bundled first.
import { rm } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import * as esbuild from 'esbuild';

export const root = join(dirname(fileURLToPath(import.meta.url)), '..');

/**
 * Bundles `sources` (paths below the root) and returns the paths of the results.
 * They lie in node_modules, so that the packages they import are found; `name` keeps uses apart.
 * @param {string} name
 * @param {string[]} sources
 * @returns {Promise<string[]>}
 */
export async function bundleForNode(name, sources) {
  const output = join(root, 'node_modules/.cache', name);
  await rm(output, { recursive: true, force: true });
  await esbuild.build({
    entryPoints: sources.map((source) => join(root, source)),
    outdir: output,
    outbase: root,
    outExtension: { '.js': '.mjs' },
    bundle: true,
    packages: 'external',
    platform: 'node',
    format: 'esm',
    target: 'node18',
    sourcemap: 'inline',
    logLevel: 'warning',
  });
  return sources.map((source) => join(output, source.replace(/\.ts$/, '.mjs')));
}
