// Runs test/*.test.ts and e2e/*.test.ts, or the files named on the command line, with Node's test runner.
import { spawnSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { bundleForNode, root } from './bundle_for_node.mjs';

const all = ['test', 'e2e'].flatMap((folder) =>
  readdirSync(join(root, folder))
    .filter((name) => name.endsWith('.test.ts'))
    .map((name) => `${folder}/${name}`),
);
const named = process.argv.slice(2);
const files = await bundleForNode('tests', named.length > 0 ? named : all);
const { status } = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...files], {
  cwd: root,
  stdio: 'inherit',
});
process.exitCode = status ?? 1;
