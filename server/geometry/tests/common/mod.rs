//! The EuRoC `V1_01` stereo calibration, as published with the data set.

use geometry::{CameraModel, Distortion, Pinhole, StereoCalibration};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

fn camera([fx_px, fy_px, cx_px, cy_px]: [f64; 4], [k1, k2, p1, p2]: [f64; 4]) -> CameraModel {
    CameraModel {
        pinhole: Pinhole { width_px: 752, height_px: 480, fx_px, fy_px, cx_px, cy_px },
        distortion: Distortion::RadialTangential([k1, k2, p1, p2, 0.0]),
    }
}

pub fn euroc() -> StereoCalibration {
    let rotation = Matrix3::new(
        9.999972564779e-01,
        2.312067192424e-03,
        3.760081024156e-04,
        -2.317135723281e-03,
        9.998980485066e-01,
        1.408983584665e-02,
        -3.433931205242e-04,
        -1.409066845271e-02,
        9.999006626377e-01,
    );
    let translation = Vector3::new(-0.110073808127, 0.000399121547, -0.000853702503);
    StereoCalibration {
        left: camera(
            [458.654, 457.296, 367.215, 248.375],
            [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05],
        ),
        right: camera(
            [457.587, 456.134, 379.999, 255.238],
            [-0.28368365, 0.07451284, -0.00010473, -3.555907e-05],
        ),
        right_from_left: nalgebra::Isometry3::from_parts(
            Translation3::from(translation),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)),
        ),
    }
}
