//! Which rows are matched at once: the volumes of costs of a large image exceed what a binding can address.

use bytemuck::{Pod, Zeroable};
use gpu::Gpu;

use super::config::{DisparityConfig, SgmConfig};
use super::range::DisparityRange;
use crate::DenseError;

/// `Band` of `common.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Band {
    /// Columns of the image.
    pub width: u32,
    /// Rows of the image.
    pub height: u32,
    /// Words of four pixels per padded row.
    pub words: u32,
    /// Disparity of index 0.
    pub min_disparity: i32,
    /// First row whose costs the band holds.
    pub first_row: u32,
    /// Rows whose costs the band holds.
    pub rows: u32,
    /// First row whose result is kept.
    pub keep_first: u32,
    /// Rows whose result is kept.
    pub keep_rows: u32,
    /// Groups of 16 disparities.
    pub groups: u32,
    padding: [u32; 3],
}

impl Band {
    /// The whole image as one band.
    pub fn whole(size: (u32, u32), range: DisparityRange) -> Self {
        let (width, height) = size;
        Self {
            width,
            height,
            words: width.div_ceil(4),
            min_disparity: range.min_px,
            first_row: 0,
            rows: height,
            keep_first: 0,
            keep_rows: height,
            groups: range.groups,
            padding: [0; 3],
        }
    }

    /// Elements (words of four pixels) of a padded image.
    pub fn image_words(&self) -> usize {
        self.words as usize * self.height as usize
    }

    /// Pixels of the band.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.rows as usize
    }
}

/// The bands of an image, from the top down: none has more rows than `rows_max`, neighbours overlap by `margin` rows
/// to each side of what is kept.
///
/// # Errors
/// [`DenseError::Config`] where the memory allowed does not hold the margins and a row between them.
pub(super) fn bands(whole: Band, rows_max: u32, margin: u32) -> Result<Vec<Band>, DenseError> {
    if rows_max >= whole.height {
        return Ok(vec![whole]);
    }
    let keep_rows_max = rows_max.saturating_sub(2 * margin);
    if keep_rows_max == 0 {
        return Err(DenseError::Config {
            field: "disparity.volume_mib",
            value: f64::from(rows_max),
            requirement: "enough for more image rows at once than twice disparity.band_margin_px",
        });
    }
    let count = whole.height.div_ceil(keep_rows_max);
    let share = whole.height.div_ceil(count);
    let cut = |index: u32| {
        let keep_first = index * share;
        let keep_end = (keep_first + share).min(whole.height);
        let first_row = keep_first.saturating_sub(margin);
        let end_row = (keep_end + margin).min(whole.height);
        Band { first_row, rows: end_row - first_row, keep_first, keep_rows: keep_end - keep_first, ..whole }
    };
    Ok((0..whole.height.div_ceil(share)).map(cut).collect())
}

/// The most rows whose volumes fit the configured memory and one binding of this adapter.
pub(super) fn rows_at_once(gpu: &Gpu, whole: &Band, config: &DisparityConfig) -> u32 {
    let row_bytes = u64::from(whole.width) * u64::from(whole.groups) * 16;
    let volumes = u64::from(volume_count(&config.sgm)) + 1;
    let allowed = (u64::from(config.volume_mib) << 20) / volumes;
    let bytes = allowed.min(gpu.description().max_binding_bytes);
    u32::try_from(bytes / row_bytes.max(1)).unwrap_or(u32::MAX)
}

/// Volumes of summed paths: two paths each.
pub(super) fn volume_count(config: &SgmConfig) -> u32 {
    config.paths / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_keep_every_row_once_and_hold_their_margins() {
        let range = DisparityRange { min_px: 0, groups: 2 };
        let whole = Band::whole((37, 101), range);
        for rows_max in [30, 40, 77, 100] {
            let bands = bands(whole, rows_max, 10).unwrap();
            let kept: Vec<u32> =
                bands.iter().flat_map(|band| band.keep_first..band.keep_first + band.keep_rows).collect();
            assert_eq!(kept, (0..101).collect::<Vec<_>>());
            for band in bands {
                assert!(band.rows <= rows_max, "{band:?}");
                assert!(band.keep_first - band.first_row == 10 || band.first_row == 0);
                let end = band.first_row + band.rows;
                assert!(end - band.keep_first - band.keep_rows == 10 || end == 101);
            }
        }
    }

    #[test]
    fn memory_for_less_than_the_margins_is_refused() {
        let whole = Band::whole((37, 101), DisparityRange { min_px: 0, groups: 2 });
        assert!(bands(whole, 20, 10).unwrap_err().to_string().contains("disparity.volume_mib"));
    }
}
