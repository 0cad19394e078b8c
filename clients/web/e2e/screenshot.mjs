// Looks at screenshots.

/**
 * How many different colours (of 16 steps a channel) a part of a screenshot has; decoded by the browser that took it.
 * @param {import('playwright-core').Page} page
 * @param {Buffer} image
 * @param {{ x: number, y: number, width: number, height: number }} area in pixels
 * @returns {Promise<number>}
 */
async function countColors(page, image, area) {
  return page.evaluate(
    async ({ base64, area }) => {
      // Not by fetch: the page's content security policy allows no other addresses than the server's.
      const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
      const context = canvas.getContext('2d');
      if (context === null) return 0;
      context.drawImage(bitmap, 0, 0);
      const { data } = context.getImageData(area.x, area.y, area.width, area.height);
      const colors = new Set();
      for (let i = 0; i < data.length; i += 4) {
        colors.add(
          (((data[i] ?? 0) >> 4) << 8) | (((data[i + 1] ?? 0) >> 4) << 4) | ((data[i + 2] ?? 0) >> 4),
        );
      }
      return colors.size;
    },
    { base64: image.toString('base64'), area },
  );
}

/** What the empty background has at most: a gradient in few steps. */
const BACKGROUND_COLORS = 12;

/**
 * Hides or shows what lies over the 3-D view: buttons, banners and legends. By properties, because the page's content
 * security policy allows no style sheet but its own.
 * @param {import('playwright-core').Page} page
 * @param {'hidden' | ''} visibility
 */
function setOverlays(page, visibility) {
  return page.locator('.stage > :not(canvas)').evaluateAll((overlays, visibility) => {
    for (const overlay of overlays) {
      if (overlay instanceof HTMLElement) overlay.style.visibility = visibility;
    }
  }, visibility);
}

/** Frames after which what the page has just taken in is in its 3-D view. */
const FRAMES_BEHIND = 3;
const FRAMES_TIMEOUT_MS = 10_000;

/** @param {import('playwright-core').Page} page */
async function drawn(page) {
  const count = () => page.evaluate('misSlam.framesDrawn').then(Number);
  const wanted = (await count()) + FRAMES_BEHIND;
  const endMs = Date.now() + FRAMES_TIMEOUT_MS;
  while ((await count()) < wanted && Date.now() < endMs) await page.waitForTimeout(20);
}

/**
 * The 3-D view as it is seen with nothing over it.
 * @param {import('playwright-core').Page} page
 */
export async function viewPicture(page) {
  await drawn(page);
  await setOverlays(page, 'hidden');
  try {
    return await page.locator('.stage canvas').screenshot();
  } finally {
    await setOverlays(page, '');
  }
}

/**
 * How many colours the middle of the 3-D view has, of 16 steps a channel; 0 on a page without one.
 * @param {import('playwright-core').Page} page
 */
export async function colorsInView(page) {
  const canvas = page.locator('.stage canvas');
  const box = (await canvas.count()) > 0 ? await canvas.boundingBox() : null;
  if (box === null) return 0;
  const middle = {
    x: Math.round(0.25 * box.width),
    y: Math.round(0.3 * box.height),
    width: Math.round(0.5 * box.width),
    height: Math.round(0.4 * box.height),
  };
  return countColors(page, await viewPicture(page), middle);
}

/**
 * Whether the 3-D view shows something: in its middle it has more colours than its background.
 * @param {import('playwright-core').Page} page
 */
export async function notBlank(page) {
  return (await colorsInView(page)) > BACKGROUND_COLORS;
}
