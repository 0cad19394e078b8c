//! The figures that the paper prints (Song et al. 2018, section IV), each with ours beside it where the run is of that kind.
//!
//! The paper measures in its own world. A world figure of ours holds the drift of the scope's trajectory, which no camera
//! can tell from tissue that moves as a whole; the figure in the camera's frame leaves it out. Both are shown.

use serde::Serialize;

use crate::figures::Figures;
use crate::truth::Known;

/// A row of the table.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PaperRow {
    /// What is measured, on what.
    pub what: &'static str,
    pub paper: &'static str,
    /// In the world, as the paper; `None` where the run is of another kind or has no such figure.
    pub ours: Option<f64>,
    /// The same in the camera's frame.
    pub ours_in_camera: Option<f64>,
    pub unit: &'static str,
    /// Whether the run is of this row's kind.
    pub applies: bool,
}

/// What a run is of, as far as its recording tells.
#[derive(Clone, Debug, PartialEq)]
enum Subject {
    Scene(String),
    Hamlyn(String),
    Other,
}

struct Printed {
    what: &'static str,
    paper: &'static str,
    kind: Kind,
}

enum Kind {
    /// Simulated organ: distance of material points from where they truly are.
    Points(&'static str),
    /// Phantom: distance of the surface.
    Surface(&'static str),
    /// Hamlyn in-vivo set: model against measured depth.
    BackProjection(&'static str),
    /// Any run.
    Tracking,
    Frame,
}

const fn printed(what: &'static str, paper: &'static str, kind: Kind) -> Printed {
    Printed { what, paper, kind }
}

const PRINTED: [Printed; 9] = [
    printed(
        "simulated heart, distance of points",
        "0.41 (0.46 without pose initialisation)",
        Kind::Points("heart"),
    ),
    printed("simulated liver, distance of points", "0.66 (0.68 without)", Kind::Points("liver")),
    printed("simulated right kidney, distance of points", "0.62 (0.82 without)", Kind::Points("kidney")),
    printed("ex-vivo phantoms, distance of the surface", "0.28, 0.35", Kind::Surface("phantom")),
    printed("Hamlyn 6, back-projection", "0.18", Kind::BackProjection("6")),
    printed("Hamlyn 20, back-projection", "0.13", Kind::BackProjection("20")),
    printed("Hamlyn 21, back-projection", "0.12", Kind::BackProjection("21")),
    printed("tracking of a frame (i7-4770K)", "15 at 640x480, 12 at 720x288", Kind::Tracking),
    printed("whole frame (GTX TITAN X)", "70", Kind::Frame),
];

/// The whole table, whatever the run is of.
pub(crate) fn rows(figures: &Figures, known: &Known) -> Vec<PaperRow> {
    let subject = Subject::of(known);
    PRINTED.iter().map(|printed| printed.row(&subject, figures, known)).collect()
}

impl Subject {
    fn of(known: &Known) -> Self {
        if let Some(scene) = known.note("simulation", "scene") {
            return Self::Scene(scene.to_owned());
        }
        match (known.note("import", "kind"), known.note("import", "source")) {
            (Some("hamlyn"), Some(source)) => {
                Self::Hamlyn(source.trim_start_matches(|c: char| !c.is_ascii_digit() || c == '0').to_owned())
            }
            _ => Self::Other,
        }
    }
}

impl Printed {
    fn row(&self, subject: &Subject, figures: &Figures, known: &Known) -> PaperRow {
        let applies = match self.kind {
            Kind::Points(scene) | Kind::Surface(scene) => *subject == Subject::Scene(scene.to_owned()),
            Kind::BackProjection(set) => *subject == Subject::Hamlyn(set.to_owned()),
            Kind::Tracking | Kind::Frame => true,
        };
        let (ours, ours_in_camera) = if applies { self.ours(figures, known) } else { (None, None) };
        let unit = if matches!(self.kind, Kind::Tracking | Kind::Frame) { "ms" } else { "mm" };
        PaperRow { what: self.what, paper: self.paper, ours, ours_in_camera, unit, applies }
    }

    /// In the world and in the camera.
    fn ours(&self, figures: &Figures, known: &Known) -> (Option<f64>, Option<f64>) {
        let scores = known.scores.as_ref();
        match self.kind {
            Kind::Points(_) => (
                scores.and_then(|scores| Some(scores.points.point_error_mm.as_ref()?.distance_mm.mean)),
                scores.and_then(|scores| Some(scores.points.point_error_camera_mm?.mean)),
            ),
            Kind::Surface(_) => (
                scores.and_then(|scores| Some(scores.surface.surface_error_mm.as_ref()?.distance_mm.mean)),
                scores.and_then(|scores| {
                    Some(scores.surface.surface_error_camera_mm.as_ref()?.distance_mm.mean)
                }),
            ),
            // Model and measurement meet in the camera: there is no other frame.
            Kind::BackProjection(_) => (None, Some(figures.back_projection_mm.mean)),
            Kind::Tracking => (figures.stages.get("tracking").map(|stage| stage.median_ms), None),
            Kind::Frame => (Some(figures.frame_ms.median), None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(group: &str, notes: &[(&str, &str)]) -> Known {
        let notes = notes.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
        let mut known = Known::default();
        known.notes.insert(group.to_owned(), notes);
        known
    }

    #[test]
    fn a_recording_tells_which_row_is_its_own() {
        assert_eq!(Subject::of(&known("simulation", &[("scene", "liver")])), Subject::Scene("liver".into()));
        let hamlyn = known("import", &[("kind", "hamlyn"), ("source", "rectified06")]);
        assert_eq!(Subject::of(&hamlyn), Subject::Hamlyn("6".into()));
        let other = known("import", &[("kind", "kitti"), ("source", "06")]);
        assert_eq!(Subject::of(&other), Subject::Other);
        assert_eq!(Subject::of(&Known::default()), Subject::Other);
    }
}
