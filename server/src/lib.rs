//! Networked reconstruction server for stereo endoscopy.
