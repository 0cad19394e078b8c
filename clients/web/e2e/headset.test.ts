/** The model in an emulated headset (iwer), against the fake server. */
import assert from 'node:assert/strict';
import { after, afterEach, before, beforeEach, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { Matrix4, Quaternion, Vector3 } from 'three';
import type { PageStatus } from '../src/page_status';
import { launchChromium } from './chromium.mjs';
import { FakeServer } from './fake_server';
import { TIMEOUT_MS, untilHere, untilOn } from './until';

/** Makes a Quest 3 of the browser; its controllers are moved through `window.xrDevice`. */
const EMULATION = `
  window.xrDevice = new IWER.XRDevice(IWER.metaQuest3);
  window.xrDevice.installRuntime({ forceInstall: true });
  window.xrDevice.position.set(0, 1.6, 0);
`;

let browser: Browser;
let server: FakeServer;
let page: Page;
let errors: string[];

before(async () => {
  browser = await launchChromium();
  server = await FakeServer.start({ surfels: 10_000, epochsPerS: 2 });
});
after(async () => {
  await browser.close();
  await server.stop();
});

/** A page of its own browser profile, in whose headset the model is about to be shown. */
async function openPage(): Promise<Page> {
  const opened = await browser.newPage({ viewport: { width: 900, height: 700 } });
  opened.setDefaultTimeout(TIMEOUT_MS);
  opened.on('pageerror', (error) => errors.push(String(error)));
  await opened.addInitScript({ path: 'node_modules/iwer/build/iwer.min.js' });
  await opened.addInitScript(EMULATION);
  await opened.goto(`${server.url}/#/sessions/${server.session.id}`);
  return opened;
}

beforeEach(async () => {
  errors = [];
  page = await openPage();
  await until('misSlam.following && misSlam.framesDrawn > 5');
});
afterEach(async () => {
  assert.deepEqual(errors, []);
  await page.close();
});

const until = (expression: string): Promise<PageStatus> => untilOn(page, expression);

type Place = [number, number, number];

/** Where the model's world origin is in the room. */
function place({ headset }: PageStatus): Place {
  const [x, y, z] = (headset ?? assert.fail('no headset')).slice(12, 15);
  return [x ?? Number.NaN, y ?? Number.NaN, z ?? Number.NaN];
}

async function moveHand(hand: 'left' | 'right', x: number, y: number, z: number): Promise<void> {
  await page.evaluate(`xrDevice.controllers.${hand}.position.set(${x}, ${y}, ${z})`);
  await drawn();
}

async function press(hand: 'left' | 'right', button: 'trigger' | 'squeeze', value: 0 | 1): Promise<void> {
  await page.evaluate(`xrDevice.controllers.${hand}.updateButtonValue('${button}', ${value})`);
  await drawn();
}

/** Waits until the headset has drawn what was just changed. */
async function drawn(): Promise<void> {
  const { framesDrawn } = (await page.evaluate('misSlam')) as PageStatus;
  await until(`misSlam.framesDrawn > ${framesDrawn + 2}`);
}

for (const [label, blending] of [
  ['VR', 'opaque'],
  ['AR', 'alpha-blend'],
] as const) {
  test(`${label} shows the model in life size before the eyes, and gives the page back`, async () => {
    await page.getByRole('button', { name: label, exact: true }).click();
    const status = await until('misSlam.headset !== null');
    assert.equal(await page.evaluate('xrDevice.activeSession.environmentBlendMode'), blending);
    const column = (status.headset ?? []).slice(0, 3);
    assert.ok(Math.abs(Math.hypot(...column) - 1) < 1e-6, `scale of ${column}`);
    const [x, y, z] = place(status);
    assert.ok(Math.abs(x) < 0.1 && y > 1.2 && y < 1.6 && z < -0.3 && z > -0.7, `${[x, y, z]}`);
    await page.evaluate('xrDevice.activeSession.end()');
    const { framesDrawn } = await until('misSlam.headset === null');
    await until(`misSlam.framesDrawn > ${framesDrawn}`);
  });
}

test('a headset asks for what it can draw, where its wearer looks, and the page for all again', async () => {
  await page.getByRole('button', { name: 'VR', exact: true }).click();
  await until('misSlam.headset !== null');
  await untilHere(page, () => server.session.wishes?.maxSurfels === 150_000);
  await untilHere(page, () => server.session.wishes?.gazeInWorld !== undefined);
  const { xM = 0, yM = 0, zM = 0 } = server.session.wishes?.gazeInWorld ?? {};
  // Straight ahead, which is a little above the model.
  assert.ok(Math.abs(xM) < 0.05 && yM < 0 && yM > -0.3 && zM > 0 && zM < 0.2, `${[xM, yM, zM]}`);
  await page.evaluate('xrDevice.activeSession.end()');
  await untilHere(page, () => server.session.wishes?.maxSurfels === 0);
});

test('a hand that grabs the model carries it', async () => {
  await page.getByRole('button', { name: 'VR', exact: true }).click();
  const before = place(await until('misSlam.headset !== null'));
  await moveHand('right', 0.2, 1.2, -0.3);
  await press('right', 'squeeze', 1);
  await moveHand('right', 0.3, 1.3, -0.3);
  await press('right', 'squeeze', 0);
  const after = place((await page.evaluate('misSlam')) as PageStatus);
  const moved = after.map((value, axis) => value - (before[axis] ?? 0));
  assert.ok(Math.hypot((moved[0] ?? 0) - 0.1, (moved[1] ?? 0) - 0.1, moved[2] ?? 0) < 5e-3, `${moved}`);
});

/** Turns a hand so that its ray goes from where it is to a place. */
async function aim(hand: 'left' | 'right', from: Place, at: Place): Promise<void> {
  await moveHand(hand, ...from);
  const direction = new Vector3(...at).sub(new Vector3(...from)).normalize();
  const { x, y, z, w } = new Quaternion().setFromUnitVectors(new Vector3(0, 0, -1), direction);
  await page.evaluate(`xrDevice.controllers.${hand}.quaternion.set(${x}, ${y}, ${z}, ${w})`);
  await drawn();
}

async function click(hand: 'left' | 'right'): Promise<void> {
  await press(hand, 'trigger', 1);
  await press(hand, 'trigger', 0);
}

test('a tool is chosen on the wrist and measures where the other hand points', async () => {
  await page.getByRole('button', { name: 'VR', exact: true }).click();
  const { headset } = await until('misSlam.headset !== null');
  // Both ends on one shape of the breathing surface, however long it takes to aim.
  server.session.pause();
  await moveHand('left', -0.25, 1.3, -0.35);
  // The second plate of the menu, which is tilted over the left hand.
  await aim('right', [0.2, 1.4, -0.1], [-0.25, 1.3 + 0.078 * Math.cos(0.6), -0.35 - 0.078 * Math.sin(0.6)]);
  await click('right');
  const roomFromWorld = new Matrix4().fromArray([...(headset ?? [])]);
  for (const x of [-0.015, 0.02]) {
    const target = new Vector3(x, 0.002, 0.088).applyMatrix4(roomFromWorld);
    // From straight before it, so that the surface's folds do not shift where the ray meets it.
    await aim('right', [target.x, target.y, target.z + 0.3], target.toArray());
    await click('right');
  }
  const { measuredMm } = await until('misSlam.measuredMm.length === 1');
  server.session.resume();
  assert.ok(Math.abs((measuredMm[0] ?? 0) - 35) < 4, `${measuredMm} mm`);
});

/** Touches three points with the right hand as the align tool wants it, and so gives the room its marker frame. */
async function touchMarker(of: Page, points: readonly Place[]): Promise<void> {
  page = of;
  await moveHand('left', -0.25, 1.3, -0.35);
  // The third plate of the menu.
  await aim('right', [0.2, 1.4, -0.1], [-0.25, 1.3 + 0.106 * Math.cos(0.6), -0.35 - 0.106 * Math.sin(0.6)]);
  await click('right');
  for (const point of points) {
    await moveHand('right', ...point);
    await click('right');
  }
}

test('two headsets whose wearers touch the same marker see the model at one place', async () => {
  const [first, second] = [page, await openPage()];
  const shiftM = 0.5;
  for (const [wearer, offsetM] of [
    [first, 0],
    [second, shiftM],
  ] as const) {
    page = wearer;
    await page.getByRole('button', { name: 'VR', exact: true }).click();
    await until('misSlam.headset !== null');
    // The rooms of the two headsets differ by a shift along x.
    await touchMarker(wearer, [
      [offsetM, 1, -0.5],
      [offsetM + 0.2, 1, -0.5],
      [offsetM, 1, -0.7],
    ]);
  }
  page = first;
  await press('right', 'squeeze', 1);
  await moveHand('right', 0.4, 1.2, -0.6);
  await press('right', 'squeeze', 0);
  const placed = place((await page.evaluate('misSlam')) as PageStatus);
  page = second;
  const expected = [placed[0] + shiftM, placed[1], placed[2]];
  const [x, y, z] = expected;
  await until(
    `Math.hypot(misSlam.headset[12] - ${x}, misSlam.headset[13] - ${y}, misSlam.headset[14] - ${z}) < 1e-3`,
  );
  await second.close();
  page = first;
});

test('two hands drawn apart make the model larger', async () => {
  await page.getByRole('button', { name: 'VR', exact: true }).click();
  await until('misSlam.headset !== null');
  await moveHand('left', -0.1, 1.2, -0.3);
  await moveHand('right', 0.1, 1.2, -0.3);
  await press('left', 'squeeze', 1);
  await press('right', 'squeeze', 1);
  await moveHand('right', 0.3, 1.2, -0.3);
  await press('right', 'squeeze', 0);
  await press('left', 'squeeze', 0);
  const { headset } = (await page.evaluate('misSlam')) as PageStatus;
  assert.ok(Math.abs(Math.hypot(...(headset ?? []).slice(0, 3)) - 2) < 0.02);
});
