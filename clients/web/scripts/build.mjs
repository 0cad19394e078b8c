// Bundles the page into dist/: index.html, main.js, main.css, favicon.svg.
// With --watch it goes on doing so, and adds source maps.
import { copyFile, mkdir, rm } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import * as esbuild from 'esbuild';

const root = join(dirname(fileURLToPath(import.meta.url)), '..');
const source = join(root, 'src');
const output = join(root, 'dist');

const watch = process.argv.includes('--watch');
/** @type {esbuild.BuildOptions} */
const options = {
  entryPoints: { main: join(source, 'main.ts') },
  outdir: output,
  bundle: true,
  format: 'esm',
  target: ['es2022', 'chrome100', 'firefox100', 'safari15.4'],
  minify: true,
  sourcemap: watch,
  legalComments: 'linked',
  logLevel: 'warning',
};

await rm(output, { recursive: true, force: true });
await mkdir(output, { recursive: true });
for (const file of ['index.html', 'favicon.svg']) await copyFile(join(source, file), join(output, file));

if (watch) {
  await (await esbuild.context(options)).watch();
} else {
  await esbuild.build(options);
}
