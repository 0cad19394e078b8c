// Serves dist/ and a synthetic session on http://127.0.0.1:8099 (or the port given), until Ctrl-C. With --replay the
// session replays a recording.
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { bundleForNode } from './bundle_for_node.mjs';

const [bundled] = await bundleForNode('fake_server', ['e2e/fake_server.ts']);
const { FakeServer } = await import(pathToFileURL(String(bundled)).href);
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { replay: { type: 'boolean', default: false } },
});
const server = await FakeServer.start({
  port: Number(positionals[0] ?? 8099),
  surfels: 60_000,
  epochsPerS: 10,
  replay: values.replay ?? false,
});
console.log(`serving at ${server.url}`);
