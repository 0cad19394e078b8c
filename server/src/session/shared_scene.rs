//! What the viewers of a session share: notes on the tissue and the model's place in the room.

use std::collections::BTreeMap;

use protocol::limits::{
    ANNOTATION_AUTHOR_MAX_CHARS, ANNOTATION_TEXT_MAX_CHARS, ANNOTATIONS_MAX, HEADSETS_MAX, PLACEMENT_SCALES,
};
use protocol::v1::shared_change::Change;
use protocol::v1::{Annotation, HeadsetAnchor, Placement, RigidTransform, SharedChange, SharedScene as Wire};
use protocol::{ProtocolError, SessionId};

/// Why a change was not made.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum SharedError {
    /// No change is named, or one that this version does not know.
    #[error("the change is empty or unknown")]
    Unknown,
    /// A note's text or author.
    #[error("{field} has {chars} characters; it may have {min} to {max}")]
    Length {
        /// `text` or `author`.
        field: &'static str,
        /// What it has.
        chars: usize,
        /// The least.
        min: usize,
        /// The most.
        max: usize,
    },
    /// A number that is none, a scale out of range, or a rotation that is none.
    #[error("{field} cannot be used: {value}")]
    Value {
        /// Of the message.
        field: &'static str,
        /// As it came.
        value: String,
    },
    /// The note is not there.
    #[error("there is no annotation {0}")]
    NoSuchAnnotation(u32),
    /// No more fit.
    #[error("there are {max} {things} already")]
    Full {
        /// `annotations` or `headsets`.
        things: &'static str,
        /// The limit.
        max: usize,
    },
    /// A headset's name.
    #[error("headset: {0}")]
    Headset(#[from] ProtocolError),
}

/// The shared state of one session.
#[derive(Debug, Default)]
pub struct SharedScene {
    annotations: BTreeMap<u32, Annotation>,
    last_id: u32,
    placement: Option<Placement>,
    anchors: BTreeMap<String, HeadsetAnchor>,
}

impl SharedScene {
    /// Makes a change, or leaves everything as it is.
    ///
    /// # Errors
    /// [`SharedError`].
    pub fn apply(&mut self, change: SharedChange) -> Result<(), SharedError> {
        match change.change.ok_or(SharedError::Unknown)? {
            Change::Annotate(annotation) => self.annotate(annotation),
            Change::EraseAnnotation(id) => {
                self.annotations.remove(&id).map(|_| ()).ok_or(SharedError::NoSuchAnnotation(id))
            }
            Change::Place(placement) => self.place(placement),
            Change::Anchor(anchor) => self.anchor(anchor),
        }
    }

    /// Another reconstruction has begun, in another world: what was bound to places in the last one is gone.
    pub fn forget_world(&mut self) {
        self.annotations.clear();
        self.placement = None;
    }

    /// The whole state.
    pub fn to_wire(&self) -> Wire {
        Wire {
            annotations: self.annotations.values().cloned().collect(),
            placement: self.placement,
            anchors: self.anchors.values().cloned().collect(),
        }
    }

    fn annotate(&mut self, annotation: Annotation) -> Result<(), SharedError> {
        check_length("text", &annotation.text, 1, ANNOTATION_TEXT_MAX_CHARS)?;
        check_length("author", &annotation.author, 0, ANNOTATION_AUTHOR_MAX_CHARS)?;
        let point = annotation.point_in_world.unwrap_or_default();
        check_finite("point_in_world", &[point.x_m, point.y_m, point.z_m].map(f64::from))?;
        let id = match annotation.id {
            0 => self.next_id()?,
            id if self.annotations.contains_key(&id) => id,
            id => return Err(SharedError::NoSuchAnnotation(id)),
        };
        self.annotations.insert(id, Annotation { id, ..annotation });
        Ok(())
    }

    /// Ids are never used again: a viewer that erases a note cannot hit another's.
    fn next_id(&mut self) -> Result<u32, SharedError> {
        if self.annotations.len() >= ANNOTATIONS_MAX {
            return Err(SharedError::Full { things: "annotations", max: ANNOTATIONS_MAX });
        }
        self.last_id += 1;
        Ok(self.last_id)
    }

    fn place(&mut self, placement: Placement) -> Result<(), SharedError> {
        check_transform("marker_from_world", placement.marker_from_world.as_ref())?;
        if !PLACEMENT_SCALES.contains(&placement.scale) {
            return Err(SharedError::Value { field: "scale", value: placement.scale.to_string() });
        }
        self.placement = Some(placement);
        Ok(())
    }

    fn anchor(&mut self, anchor: HeadsetAnchor) -> Result<(), SharedError> {
        let _: SessionId = anchor.headset.parse()?;
        check_transform("room_from_marker", anchor.room_from_marker.as_ref())?;
        if self.anchors.len() >= HEADSETS_MAX && !self.anchors.contains_key(&anchor.headset) {
            return Err(SharedError::Full { things: "headsets", max: HEADSETS_MAX });
        }
        self.anchors.insert(anchor.headset.clone(), anchor);
        Ok(())
    }
}

fn check_length(field: &'static str, text: &str, min: usize, max: usize) -> Result<(), SharedError> {
    let chars = text.chars().count();
    if (min..=max).contains(&chars) { Ok(()) } else { Err(SharedError::Length { field, chars, min, max }) }
}

fn check_finite(field: &'static str, values: &[f64]) -> Result<(), SharedError> {
    if values.iter().all(|value| value.is_finite()) {
        return Ok(());
    }
    Err(SharedError::Value { field, value: format!("{values:?}") })
}

fn check_transform(field: &'static str, transform: Option<&RigidTransform>) -> Result<(), SharedError> {
    let Some(RigidTransform { tx_m, ty_m, tz_m, qx, qy, qz, qw }) = transform else {
        return Err(SharedError::Value { field, value: "absent".to_owned() });
    };
    check_finite(field, &[*tx_m, *ty_m, *tz_m])?;
    let norm = [qx, qy, qz, qw].map(|value| value * value).iter().sum::<f64>();
    // NaN is outside of every range.
    if (0.99..=1.01).contains(&norm) {
        return Ok(());
    }
    Err(SharedError::Value { field, value: format!("a quaternion of squared length {norm}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(id: u32, text: &str) -> SharedChange {
        let annotation = Annotation { id, surfel_id: 7, text: text.to_owned(), ..Annotation::default() };
        SharedChange { change: Some(Change::Annotate(annotation)) }
    }

    fn at(tx_m: f64) -> RigidTransform {
        RigidTransform { tx_m, qw: 1.0, ..RigidTransform::default() }
    }

    fn place(scale: f32, tx_m: f64) -> SharedChange {
        let placement = Placement { marker_from_world: Some(at(tx_m)), scale };
        SharedChange { change: Some(Change::Place(placement)) }
    }

    fn anchor(headset: &str) -> SharedChange {
        let anchor = HeadsetAnchor { headset: headset.to_owned(), room_from_marker: Some(at(0.0)) };
        SharedChange { change: Some(Change::Anchor(anchor)) }
    }

    #[test]
    fn another_world_has_none_of_the_notes_and_the_headsets_stay_where_they_are() {
        let mut scene = SharedScene::default();
        for change in [note(0, "polyp"), place(1.0, 0.5), anchor("quest")] {
            scene.apply(change).unwrap();
        }
        scene.forget_world();
        let told = scene.to_wire();
        assert_eq!((told.annotations.len(), told.placement, told.anchors.len()), (0, None, 1));
        scene.apply(note(0, "vessel")).unwrap();
        assert_eq!(scene.to_wire().annotations[0].id, 2);
    }

    #[test]
    fn a_note_is_added_replaced_and_erased_and_its_id_never_used_again() {
        let mut scene = SharedScene::default();
        scene.apply(note(0, "polyp")).unwrap();
        scene.apply(note(1, "polyp, 4 mm")).unwrap();
        assert_eq!(scene.to_wire().annotations[0].text, "polyp, 4 mm");
        scene.apply(SharedChange { change: Some(Change::EraseAnnotation(1)) }).unwrap();
        scene.apply(note(0, "vessel")).unwrap();
        assert_eq!(scene.to_wire().annotations[0].id, 2);
        assert_eq!(scene.apply(note(1, "late edit")), Err(SharedError::NoSuchAnnotation(1)));
    }

    #[test]
    fn texts_and_numbers_are_distrusted() {
        let mut scene = SharedScene::default();
        assert!(matches!(scene.apply(note(0, "")), Err(SharedError::Length { field: "text", .. })));
        assert!(scene.apply(note(0, &"x".repeat(ANNOTATION_TEXT_MAX_CHARS + 1))).is_err());
        for change in [place(f32::NAN, 0.0), place(0.0, 0.0), place(1e6, 0.0), place(1.0, f64::INFINITY)] {
            assert!(matches!(scene.apply(change), Err(SharedError::Value { .. })));
        }
        assert!(matches!(scene.apply(anchor("../etc")), Err(SharedError::Headset(_))));
        assert_eq!(scene.apply(SharedChange { change: None }), Err(SharedError::Unknown));
        assert_eq!(scene.to_wire(), Wire::default());
    }

    #[test]
    fn notes_and_headsets_are_bounded() {
        let mut scene = SharedScene::default();
        for _ in 0..ANNOTATIONS_MAX {
            scene.apply(note(0, "x")).unwrap();
        }
        assert_eq!(
            scene.apply(note(0, "x")),
            Err(SharedError::Full { things: "annotations", max: ANNOTATIONS_MAX })
        );
        for headset in 0..HEADSETS_MAX {
            scene.apply(anchor(&format!("h{headset}"))).unwrap();
        }
        assert!(scene.apply(anchor("one-more")).is_err());
        scene.apply(anchor("h0")).unwrap();
    }

    #[test]
    fn the_last_placement_counts() {
        let mut scene = SharedScene::default();
        scene.apply(place(1.0, 0.1)).unwrap();
        scene.apply(place(2.0, 0.2)).unwrap();
        assert_eq!(scene.to_wire().placement.unwrap().scale, 2.0);
    }
}
