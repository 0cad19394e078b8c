// Generates src/generated from protocol/proto. With --check it writes nothing and fails where they differ.
import { execFileSync } from 'node:child_process';
import { mkdtemp, readdir, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { delimiter, dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const root = join(dirname(fileURLToPath(import.meta.url)), '..');
const generated = join(root, 'src/generated');
const executables = join(root, 'node_modules/.bin');

/**
 * Runs buf and protoc-gen-es, both from node_modules; `output` is emptied first.
 * @param {string} output
 */
function generate(output) {
  const template = {
    version: 'v2',
    clean: true,
    plugins: [{ local: 'protoc-gen-es', out: output, opt: ['target=ts'] }],
  };
  execFileSync('buf', ['generate', '../../protocol/proto', '--template', JSON.stringify(template)], {
    cwd: root,
    env: { ...process.env, PATH: executables + delimiter + process.env.PATH },
    stdio: 'inherit',
  });
}

/**
 * Contents of all files below `folder`, by path.
 * @param {string} folder
 * @returns {Promise<Map<string, string>>}
 */
async function contents(folder) {
  const files = new Map();
  for (const entry of await readdir(folder, { withFileTypes: true }).catch(() => [])) {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) {
      for (const [name, text] of await contents(path)) files.set(join(entry.name, name), text);
    } else {
      files.set(entry.name, await readFile(path, 'utf8'));
    }
  }
  return files;
}

async function check() {
  const scratch = await mkdtemp(join(tmpdir(), 'mis-slam-web-'));
  try {
    generate(scratch);
    const [fresh, committed] = await Promise.all([contents(scratch), contents(generated)]);
    const names = new Set([...fresh.keys(), ...committed.keys()]);
    const stale = [...names].filter((name) => fresh.get(name) !== committed.get(name));
    if (stale.length > 0) {
      console.error(
        `src/generated is not what protocol/proto gives: ${stale.join(', ')}. Run: npm run generate`,
      );
      process.exitCode = 1;
    }
  } finally {
    await rm(scratch, { recursive: true, force: true });
  }
}

if (process.argv.includes('--check')) await check();
else generate(generated);
