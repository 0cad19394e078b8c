#!/usr/bin/env python3
"""Makes a recording with the public mcap packages.

    write_recording.py REC.mcap none|lz4|zstd|unchunked

Eight pairs of 16x12 rgb8 images, all pixels of frame k (k, 2 k, 3 k); a calibration; poses.
"""
import sys

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import build_file_descriptor_set

WIDTH, HEIGHT, FRAMES, START_NS, STEP_NS = 16, 12, 8, 1_700_000_000_000_000_000, 40_000_000
FX, CX, CY, BASELINE_M = 40.0, 7.5, 5.5, 0.0045


class Recording:
    def __init__(self, file, chunking):
        compression = getattr(CompressionType, chunking.upper(), CompressionType.NONE)
        self.writer = Writer(file, compression=compression, use_chunking=chunking != "unchunked")
        self.writer.start()
        self.channels = {}

    def send(self, topic, message, stamp_ns):
        message.timestamp.FromNanoseconds(stamp_ns)
        if topic not in self.channels:
            data = build_file_descriptor_set(type(message)).SerializeToString()
            schema = self.writer.register_schema(name=message.DESCRIPTOR.full_name, encoding="protobuf", data=data)
            self.channels[topic] = self.writer.register_channel(topic=topic, message_encoding="protobuf", schema_id=schema)
        self.writer.add_message(channel_id=self.channels[topic], log_time=stamp_ns, publish_time=stamp_ns, data=message.SerializeToString())


def calibration(eye):
    shift = -FX * BASELINE_M if eye == "right" else 0.0
    message = CameraCalibration(frame_id=eye, width=WIDTH, height=HEIGHT)
    message.K.extend([FX, 0, CX, 0, FX, CY, 0, 0, 1])
    message.R.extend([1, 0, 0, 0, 1, 0, 0, 0, 1])
    message.P.extend([FX, 0, CX, shift, 0, FX, CY, 0, 0, 0, 1, 0])
    return message


def main(path, chunking):
    with open(path, "wb") as file:
        recording = Recording(file, chunking)
        for frame in range(FRAMES):
            stamp_ns = START_NS + frame * STEP_NS
            for eye in ("left", "right"):
                if frame == 0:
                    recording.send(f"/stereo/{eye}/calibration", calibration(eye), stamp_ns)
                pixels = bytes([frame, 2 * frame, 3 * frame]) * (WIDTH * HEIGHT)
                image = RawImage(frame_id=eye, width=WIDTH, height=HEIGHT, encoding="rgb8", step=3 * WIDTH, data=pixels)
                recording.send(f"/stereo/{eye}/image", image, stamp_ns)
            pose = PoseInFrame(frame_id="world")
            pose.pose.position.x, pose.pose.orientation.w = 0.001 * frame, 1.0
            recording.send("/truth/pose", pose, stamp_ns)
        recording.writer.finish()


if __name__ == "__main__":
    main(*sys.argv[1:])
