// Starts Debian's Chromium without a screen, with WebGL 2.
import { existsSync } from 'node:fs';
import { chromium } from 'playwright-core';

const EXECUTABLES = [
  '/usr/bin/chromium',
  '/usr/bin/chromium-browser',
  '/snap/bin/chromium',
  '/usr/bin/google-chrome',
];
const QUIET = [
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
];
/** Mesa's software driver is some ten times faster than the one that Chromium brings along. */
const GRAPHICS = [
  ['--use-gl=angle', '--use-angle=gl-egl', '--ignore-gpu-blocklist'],
  ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
];

/** The path of the browser: the environment's MIS_SLAM_CHROMIUM, or where distributions put it. */
function executable() {
  const given = process.env.MIS_SLAM_CHROMIUM;
  const found = given ?? EXECUTABLES.find((path) => existsSync(path));
  if (found === undefined) throw new Error('Chromium is not installed: run config/setup.sh --test');
  return found;
}

/** A browser in which WebGL 2 works; the caller closes it. */
export async function launchChromium() {
  for (const graphics of GRAPHICS) {
    const browser = await chromium.launch({ executablePath: executable(), args: [...QUIET, ...graphics] });
    if (await hasWebGl2(browser)) return browser;
    await browser.close();
  }
  throw new Error('this Chromium offers no WebGL 2');
}

/** @param {import('playwright-core').Browser} browser */
async function hasWebGl2(browser) {
  const page = await browser.newPage();
  const works = await page.evaluate(() => document.createElement('canvas').getContext('webgl2') !== null);
  await page.close();
  return works;
}
