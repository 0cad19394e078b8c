#!/usr/bin/env python3
"""Makes a ROS 2 bag of stereo images with PyPI rosbags, in MCAP storage.

    write_rosbag.py FOLDER none|storage

Twelve pairs of 16x12 mono8 images; pixel (x, y) of frame k is (16 y + x + k) mod 256, on the right one more.
"""
import sys

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

WIDTH, HEIGHT, FRAMES, START_NS, STEP_NS = 16, 12, 12, 1_700_000_000_000_000_000, 50_000_000
FX, CX, CY, BASELINE_M = 40.0, 7.5, 5.5, 0.0045


def main(folder, compression):
    types = get_typestore(Stores.ROS2_HUMBLE)
    kinds = types.types
    image, info, header, time, roi = (kinds[name] for name in (
        "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo", "std_msgs/msg/Header", "builtin_interfaces/msg/Time",
        "sensor_msgs/msg/RegionOfInterest"))

    def head(stamp_ns, eye):
        return header(stamp=time(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9), frame_id=f"{eye}_optical")

    def camera(stamp_ns, eye):
        shift = -FX * BASELINE_M if eye == "right" else 0.0
        return info(header=head(stamp_ns, eye), height=HEIGHT, width=WIDTH, distortion_model="plumb_bob", d=np.zeros(5),
                    k=np.array([FX, 0, CX, 0, FX, CY, 0, 0, 1]), r=np.eye(3).ravel(),
                    p=np.array([FX, 0, CX, shift, 0, FX, CY, 0, 0, 0, 1, 0]), binning_x=0, binning_y=0,
                    roi=roi(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False))

    def picture(stamp_ns, eye, frame):
        y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
        pixels = ((16 * y + x + frame + (eye == "right")) % 256).astype(np.uint8)
        return image(header=head(stamp_ns, eye), height=HEIGHT, width=WIDTH, encoding="mono8", is_bigendian=0, step=WIDTH,
                     data=pixels.ravel())

    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    if compression == "storage":
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        channels = {}
        for eye in ("left", "right"):
            for name, kind in (("image_rect", image), ("camera_info", info)):
                channels[eye, name] = writer.add_connection(f"/{eye}/{name}", kind.__msgtype__, typestore=types)
        for frame in range(FRAMES):
            stamp_ns = START_NS + frame * STEP_NS
            for eye in ("left", "right"):
                for name, message in (("camera_info", camera(stamp_ns, eye)), ("image_rect", picture(stamp_ns, eye, frame))):
                    writer.write(channels[eye, name], stamp_ns, types.serialize_cdr(message, message.__msgtype__))


if __name__ == "__main__":
    main(*sys.argv[1:])
