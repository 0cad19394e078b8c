//! The CPU stereo tracker (ORB-SLAM class).
