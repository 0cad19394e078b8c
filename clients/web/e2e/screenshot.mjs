// Looks at screenshots.

/**
 * The pixels of a screenshot, decoded by the browser that took it and left there.
 * @param {import('playwright-core').Page} page
 * @param {Buffer} image
 */
function decoded(page, image) {
  return page.evaluateHandle(async (base64) => {
    // Not by fetch: the page's content security policy allows no other addresses than the server's.
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    if (context === null) throw new Error('no 2-D context');
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, bitmap.width, bitmap.height);
  }, image.toString('base64'));
}

/**
 * How many different colours (of 16 steps a channel) a part of a screenshot has.
 * @param {import('playwright-core').Page} page
 * @param {Buffer} image
 * @param {{ x: number, y: number, width: number, height: number }} area in pixels
 * @returns {Promise<number>}
 */
async function countColors(page, image, area) {
  return page.evaluate(
    ({ pixels: { data, width }, area }) => {
      const colors = new Set();
      for (let y = area.y; y < area.y + area.height; y++) {
        for (let i = 4 * (y * width + area.x); i < 4 * (y * width + area.x + area.width); i += 4) {
          colors.add(
            (((data[i] ?? 0) >> 4) << 8) | (((data[i + 1] ?? 0) >> 4) << 4) | ((data[i + 2] ?? 0) >> 4),
          );
        }
      }
      return colors.size;
    },
    { pixels: await decoded(page, image), area },
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
 * Whether the 3-D view shows something: in its middle it has more colours than its background. False on a page
 * without a 3-D view.
 * @param {import('playwright-core').Page} page
 */
export async function notBlank(page) {
  const canvas = page.locator('.stage canvas');
  const box = (await canvas.count()) > 0 ? await canvas.boundingBox() : null;
  if (box === null) return false;
  const middle = {
    x: Math.round(0.25 * box.width),
    y: Math.round(0.3 * box.height),
    width: Math.round(0.5 * box.width),
    height: Math.round(0.4 * box.height),
  };
  return (await countColors(page, await viewPicture(page), middle)) > BACKGROUND_COLORS;
}

/** Levels of 255 by which a pixel is another. */
const CHANGE_LEVELS = 24;

/**
 * Share of the pixels that differ between two pictures of one size.
 * @param {import('playwright-core').Page} page
 * @param {Buffer} before
 * @param {Buffer} after
 * @returns {Promise<number>}
 */
export async function changedShare(page, before, after) {
  return page.evaluate(
    ({ first, second, levels }) => {
      let changed = 0;
      for (let i = 0; i < first.data.length; i += 4) {
        const off = [0, 1, 2].map((c) => Math.abs((first.data[i + c] ?? 0) - (second.data[i + c] ?? 0)));
        changed += Math.max(...off) > levels ? 1 : 0;
      }
      return changed / Math.max(first.data.length / 4, 1);
    },
    { first: await decoded(page, before), second: await decoded(page, after), levels: CHANGE_LEVELS },
  );
}
