//! Images as they lie in recordings and on the wire, and the one place where they are decoded and encoded.

mod decode;
mod encode;

pub(crate) use decode::decode_gray16;
pub use decode::{decode_gray, decode_rgb, size_px};
pub use encode::{encode_jpeg, encode_png_gray, encode_png_rgb};

/// An image as bytes; nothing about them is checked before [`decode_rgb`] or [`decode_gray`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedImage {
    /// How the bytes are to be read.
    pub format: ImageFormat,
    /// The file, or the rows.
    pub bytes: Vec<u8>,
}

impl EncodedImage {
    /// What a file holds: PNG where it begins like one, else it is taken for JPEG.
    pub fn of_file(bytes: Vec<u8>) -> Self {
        let format = if bytes.starts_with(b"\x89PNG") { ImageFormat::Png } else { ImageFormat::Jpeg };
        Self { format, bytes }
    }
}

/// How an [`EncodedImage`] is encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// A JPEG file.
    Jpeg,
    /// A PNG file of any colour type.
    Png,
    /// Rows of pixels.
    Raw {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes from one row to the next.
        row_bytes: u32,
        /// What a pixel is.
        pixel: RawPixel,
    },
}

/// The pixel of a raw image, 8 bits a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RawPixel {
    /// Red, green, blue.
    Rgb8,
    /// Blue, green, red.
    Bgr8,
    /// Luminance.
    Mono8,
}

impl RawPixel {
    /// Bytes of a pixel.
    pub fn bytes(self) -> u32 {
        match self {
            Self::Rgb8 | Self::Bgr8 => 3,
            Self::Mono8 => 1,
        }
    }

    /// The name in Foxglove and ROS messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgb8 => "rgb8",
            Self::Bgr8 => "bgr8",
            Self::Mono8 => "mono8",
        }
    }

    /// The pixel of a Foxglove or ROS encoding, OpenCV's type names included.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "rgb8" => Some(Self::Rgb8),
            "bgr8" | "8UC3" => Some(Self::Bgr8),
            "mono8" | "8UC1" => Some(Self::Mono8),
            _ => None,
        }
    }
}

impl ImageFormat {
    /// The name in Foxglove messages and errors.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jpeg => "jpeg",
            Self::Png => "png",
            Self::Raw { pixel, .. } => pixel.name(),
        }
    }

    /// The compressed format of a Foxglove or ROS description, such as `jpeg` or `bgr8; png compressed bgr8`.
    pub fn from_description(description: &str) -> Option<Self> {
        let description = description.to_ascii_lowercase();
        if description.contains("jpeg") || description.contains("jpg") {
            Some(Self::Jpeg)
        } else if description.contains("png") {
            Some(Self::Png)
        } else {
            None
        }
    }
}
