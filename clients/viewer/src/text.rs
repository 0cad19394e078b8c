//! Words as a picture, to be laid over the view.

use ab_glyph::{Font, FontRef, Glyph, OutlinedGlyph, PxScale, ScaleFont, point};

use crate::banner::{Message, Tone};

const TITLE_PX: f32 = 22.0;
const DETAIL_PX: f32 = 17.0;
const MARGIN_PX: f32 = 12.0;
const BACKGROUND: [u8; 4] = [17, 25, 32, 225];

/// A picture of text: rows of red, green, blue and opacity.
#[derive(Clone, Debug, PartialEq)]
pub struct TextPicture {
    /// Columns, rows.
    pub size_px: (u32, u32),
    /// The pixels.
    pub rgba: Vec<[u8; 4]>,
}

/// A message as a plate of its own size, at most `width_max_px` wide; what is longer is cut off.
pub fn plate(message: &Message, width_max_px: u32) -> TextPicture {
    let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT)
        .expect("the font is a part of the program");
    let title = line(&font, &message.title, (MARGIN_PX, MARGIN_PX), TITLE_PX);
    let after_title = end_of(&title).max(MARGIN_PX) + MARGIN_PX;
    let detail = line(&font, &message.detail, (after_title, MARGIN_PX + TITLE_PX - DETAIL_PX), DETAIL_PX);
    let width = (end_of(&detail).max(after_title - MARGIN_PX) + MARGIN_PX).ceil() as u32;
    let size_px = (width.clamp(1, width_max_px.max(1)), (TITLE_PX + 2.0 * MARGIN_PX).ceil() as u32);
    let mut picture = TextPicture { size_px, rgba: vec![BACKGROUND; (size_px.0 * size_px.1) as usize] };
    title.iter().for_each(|glyph| picture.lay(glyph, color(message.tone)));
    detail.iter().for_each(|glyph| picture.lay(glyph, [219, 228, 234]));
    picture
}

fn color(tone: Tone) -> [u8; 3] {
    match tone {
        Tone::Quiet => [219, 228, 234],
        Tone::Warning => [227, 177, 92],
        Tone::Bad => [239, 138, 126],
    }
}

/// The glyphs of a line whose upper left corner is at `start`.
fn line(font: &FontRef, text: &str, (left, top): (f32, f32), height_px: f32) -> Vec<OutlinedGlyph> {
    let scaled = font.as_scaled(PxScale::from(height_px));
    let baseline = top + scaled.ascent();
    let mut caret = left;
    let mut outlined = Vec::new();
    for character in text.chars() {
        let glyph: Glyph =
            scaled.glyph_id(character).with_scale_and_position(height_px, point(caret, baseline));
        caret += scaled.h_advance(glyph.id);
        outlined.extend(font.outline_glyph(glyph));
    }
    outlined
}

fn end_of(line: &[OutlinedGlyph]) -> f32 {
    line.last().map_or(0.0, |glyph| glyph.px_bounds().max.x)
}

impl TextPicture {
    fn lay(&mut self, glyph: &OutlinedGlyph, color: [u8; 3]) {
        let (left, top) = (glyph.px_bounds().min.x as i64, glyph.px_bounds().min.y as i64);
        let (width, height) = (i64::from(self.size_px.0), i64::from(self.size_px.1));
        let rgba = &mut self.rgba;
        glyph.draw(|x, y, coverage| {
            let (x, y) = (left + i64::from(x), top + i64::from(y));
            if (0..width).contains(&x) && (0..height).contains(&y) {
                let pixel = &mut rgba[(y * width + x) as usize];
                let share = coverage.clamp(0.0, 1.0);
                for (level, ink) in pixel.iter_mut().zip(color.into_iter().chain([255])) {
                    *level = (f32::from(*level) * (1.0 - share) + f32::from(ink) * share) as u8;
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(detail: &str) -> Message {
        Message { title: "Connection lost".into(), detail: detail.into(), tone: Tone::Bad }
    }

    #[test]
    fn words_are_written_in_the_colour_of_their_urgency() {
        let picture = plate(&message("Reconnecting …"), 2000);
        assert_eq!(picture.rgba.len(), (picture.size_px.0 * picture.size_px.1) as usize);
        // Strokes are about a pixel wide, so few pixels are all ink.
        let count = |of: fn(&[u8; 4]) -> bool| picture.rgba.iter().filter(|pixel| of(pixel)).count();
        let reddish = count(|&[red, _, blue, _]| red > blue.saturating_add(30));
        let bright = count(|&[red, _, blue, _]| blue > 100 && blue >= red);
        assert!(reddish > 50 && bright > 50, "{reddish} {bright}");
        assert!(picture.size_px.0 > plate(&message(""), 2000).size_px.0 + 60);
    }

    #[test]
    fn long_words_end_at_the_edge() {
        assert_eq!(plate(&message(&"very long ".repeat(100)), 300).size_px.0, 300);
        assert_eq!(plate(&Message { title: String::new(), ..message("") }, 0).size_px.0, 1);
    }
}
