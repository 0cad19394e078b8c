// Serves dist/ and a synthetic session on http://127.0.0.1:8099 (or the port given), until Ctrl-C.
import { pathToFileURL } from 'node:url';
import { bundleForNode } from './bundle_for_node.mjs';

const [bundled] = await bundleForNode('fake_server', ['e2e/fake_server.ts']);
const { FakeServer } = await import(pathToFileURL(String(bundled)).href);
const server = await FakeServer.start({
  port: Number(process.argv[2] ?? 8099),
  surfels: 60_000,
  epochsPerS: 10,
});
console.log(`serving at ${server.url}`);
