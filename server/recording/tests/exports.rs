//! Result files come back as they were written, and wrong ones are refused.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use common::{pose, stamp};
use geometry::Raster;
use geometry::trajectory::StampedPose;
use nalgebra::Point3;
use recording::export::{
    PlySurfel, TrackedPoint, read_pfm, read_ply, read_points, read_tum, write_pfm, write_ply, write_points,
    write_tum,
};

fn surfel(index: u8) -> PlySurfel {
    let value = f32::from(index);
    PlySurfel {
        position: [value, -0.25, 1e-3],
        normal: [0.0, 0.6, -0.8],
        color: [index, 255 - index, 7],
        radius_m: 2.5e-4,
        confidence: value / 2.0,
    }
}

#[test]
fn a_ply_holds_every_property_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.ply");
    let surfels: Vec<_> = (0..100).map(surfel).collect();
    write_ply(&path, &surfels).unwrap();
    assert_eq!(read_ply(&path).unwrap(), surfels);
    write_ply(&path, &[]).unwrap();
    assert_eq!(read_ply(&path).unwrap(), []);
}

#[test]
fn the_ply_header_is_the_documented_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.ply");
    write_ply(&path, &[surfel(1)]).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let expected = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nproperty float radius\nproperty float confidence\nend_header\n";
    assert_eq!(bytes.len(), expected.len() + 35);
    assert_eq!(std::str::from_utf8(&bytes[..expected.len()]).unwrap(), expected);
}

#[test]
fn a_ply_of_another_program_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.ply");
    let text = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 2\nproperty double x\nproperty double y\n\
        property double z\nproperty int label\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        1 2 3 9\n4 5 6 9\n2 0 1\n";
    std::fs::write(&path, text).unwrap();
    let positions: Vec<_> = read_ply(&path).unwrap().iter().map(|surfel| surfel.position).collect();
    assert_eq!(positions, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
}

#[test]
fn a_ply_that_is_cut_short_or_claims_too_much_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.ply");
    write_ply(&path, &[surfel(1), surfel(2)]).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
    assert!(read_ply(&path).unwrap_err().to_string().contains("model.ply"));
    let huge = String::from_utf8_lossy(&bytes).replace("vertex 2", "vertex 99999999999");
    std::fs::write(&path, huge).unwrap();
    assert!(read_ply(&path).is_err());
}

#[test]
fn a_trajectory_keeps_nanoseconds_and_places() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trajectory.tum");
    let poses: Vec<_> =
        (0..50).map(|i| StampedPose { stamp_ns: stamp(i) + i, world_from_camera: pose(i) }).collect();
    write_tum(&path, &poses).unwrap();
    let read = read_tum(&path).unwrap();
    assert_eq!(read.len(), 50);
    for (wrote, read) in poses.iter().zip(&read) {
        assert_eq!(wrote.stamp_ns, read.stamp_ns);
        let difference = wrote.world_from_camera.inverse() * read.world_from_camera;
        assert!(difference.translation.vector.norm() < 2e-9 && difference.rotation.angle() < 1e-8);
    }
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.lines().nth(1).unwrap().starts_with("1760000000.000000000 0.000000000 -0.200000000"),
        "{text}"
    );
}

#[test]
fn trajectories_of_other_programs_are_read_and_bad_lines_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.tum");
    std::fs::write(&path, "# comment\n\n1403715273.26214 1 2 3 0 0 0 2 # tail\n7 0 0 0 0 0 0 1\n").unwrap();
    let poses = read_tum(&path).unwrap();
    assert_eq!([poses[0].stamp_ns, poses[1].stamp_ns], [1_403_715_273_262_140_000, 7_000_000_000]);
    assert_eq!(poses[0].world_from_camera.rotation.angle(), 0.0);
    for (line, named) in [
        ("1.0 1 2 3 0 0 0", "qw"),
        ("1.0 1 nan 3 0 0 0 1", "ty"),
        ("-1.0 1 2 3 0 0 0 1", "-1.0"),
        ("1.0 1 2 3 0 0 0 0", "quaternion"),
    ] {
        std::fs::write(&path, format!("# header\n{line}\n")).unwrap();
        let told = read_tum(&path).unwrap_err().to_string();
        assert!(told.contains("line 2") && told.contains(named), "{told}");
    }
}

#[test]
fn a_depth_map_keeps_its_rows_and_infinities() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("000001.pfm");
    let depth = Raster::from_fn(5, 3, |x, y| if x == 4 { f32::INFINITY } else { x as f32 + 10.0 * y as f32 });
    write_pfm(&path, &depth).unwrap();
    assert_eq!(read_pfm(&path).unwrap(), depth);
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.starts_with(b"Pf\n5 3\n-1.0\n"));
    assert_eq!(bytes[12..16], 20.0_f32.to_le_bytes(), "the bottom row comes first");
}

#[test]
fn a_depth_map_of_the_other_byte_order_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("big.pfm");
    std::fs::write(
        &path,
        [b"Pf\n1 2\n1.0\n".as_slice(), &1.5_f32.to_be_bytes(), &2.5_f32.to_be_bytes()].concat(),
    )
    .unwrap();
    assert_eq!(read_pfm(&path).unwrap().pixels(), [2.5, 1.5]);
}

#[test]
fn depth_maps_whose_size_is_wrong_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.pfm");
    for bytes in [
        &b"Pf\n4294967295 4294967295\n-1.0\n\0\0\0\0"[..],
        b"Pf\n2 2\n-1.0\n\0\0\0\0",
        b"Pf\n0 2\n-1.0\n",
        b"PF\n1 1\n-1.0\n\0\0\0\0",
        b"Pf\n1 1",
        b"",
    ] {
        std::fs::write(&path, bytes).unwrap();
        assert!(read_pfm(&path).unwrap_err().to_string().contains("bad.pfm"));
    }
}

#[test]
fn point_tracks_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.csv");
    let points = [(0, 7), (1, 7), (1, 9)].map(|(frame, id)| TrackedPoint {
        frame,
        id,
        point_in_world: Point3::new(0.1, -1e-9, f64::from(id)),
    });
    write_points(&path, &points).unwrap();
    assert_eq!(read_points(&path).unwrap(), points);
    assert!(std::fs::read_to_string(&path).unwrap().starts_with("frame,id,x,y,z\n0,7,0.1,"));
}
