//! The tracker's features drawn on the image that they were found in.

use geometry::Rgb;
use nalgebra::Point2;
use tracking::TrackedFeature;

/// A match of the map.
const MATCHED: [u8; 3] = [60, 220, 60];
/// Tissue that deforms: a line from where it was.
const DEFORMING: [u8; 3] = [255, 150, 30];
/// Seen, but known from nowhere.
const NEW: [u8; 3] = [120, 160, 255];
/// Half side of a mark, px.
const MARK_PX: i64 = 2;

/// The image with a square for each feature: green where it matches the map, orange, with a line from its last place,
/// where the tissue deforms, blue where it is new.
pub fn draw(image: &Rgb, features: &[TrackedFeature]) -> Rgb {
    let mut picture = image.clone();
    for feature in features {
        let deforming = feature.motion.filter(|motion| !motion.rigid);
        let colour = match deforming {
            _ if feature.matched => MATCHED,
            Some(_) => DEFORMING,
            None => NEW,
        };
        if let Some(motion) = deforming {
            line(&mut picture, motion.previous_pixel, feature.pixel, DEFORMING);
        }
        square(&mut picture, feature.pixel, colour);
    }
    picture
}

fn square(picture: &mut Rgb, centre: Point2<f32>, colour: [u8; 3]) {
    let (x, y) = (centre.x.round() as i64, centre.y.round() as i64);
    for offset in -MARK_PX..=MARK_PX {
        for (dx, dy) in [(offset, -MARK_PX), (offset, MARK_PX), (-MARK_PX, offset), (MARK_PX, offset)] {
            set(picture, x + dx, y + dy, colour);
        }
    }
}

fn line(picture: &mut Rgb, from: Point2<f32>, to: Point2<f32>, colour: [u8; 3]) {
    let steps = (to - from).amax().ceil().clamp(1.0, 1000.0) as u32;
    for step in 0..=steps {
        let place = from + (to - from) * (step as f32 / steps as f32);
        set(picture, place.x.round() as i64, place.y.round() as i64, colour);
    }
}

/// What lies outside is left out.
fn set(picture: &mut Rgb, x: i64, y: i64, colour: [u8; 3]) {
    let (width, height) = picture.size();
    if (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y) {
        picture[(x as u32, y as u32)] = colour;
    }
}

#[cfg(test)]
mod tests {
    use tracking::FeatureMotion;

    use super::*;

    fn feature(x: f32, y: f32, matched: bool, motion: Option<FeatureMotion>) -> TrackedFeature {
        TrackedFeature { pixel: Point2::new(x, y), depth_m: None, matched, track: None, motion }
    }

    fn moved_from(x: f32, y: f32) -> FeatureMotion {
        FeatureMotion {
            previous_pixel: Point2::new(x, y),
            previous_disparity_px: None,
            disparity_px: None,
            rigid: false,
            weight: 1.0,
        }
    }

    #[test]
    fn each_kind_of_feature_has_its_colour_and_deformation_its_line() {
        let features = [
            feature(10.0, 10.0, true, None),
            feature(30.0, 10.0, false, None),
            feature(30.0, 30.0, false, Some(moved_from(20.0, 30.0))),
        ];
        let picture = draw(&Rgb::filled(40, 40, [0; 3]), &features);
        assert_eq!(picture[(12, 10)], MATCHED);
        assert_eq!(picture[(28, 10)], NEW);
        assert_eq!((picture[(32, 30)], picture[(22, 30)]), (DEFORMING, DEFORMING));
        assert_eq!(picture[(10, 10)], [0; 3], "the feature itself stays visible");
    }

    #[test]
    fn marks_at_and_beyond_the_border_are_cut_off() {
        let features =
            [feature(0.0, 39.0, true, None), feature(39.0, 0.0, false, Some(moved_from(-90.0, 50.0)))];
        let picture = draw(&Rgb::filled(40, 40, [0; 3]), &features);
        assert_eq!(picture[(2, 39)], MATCHED);
    }
}
