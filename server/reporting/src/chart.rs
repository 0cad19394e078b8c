//! Line plots as SVG. Ink and grid have colours of their own that the page's style replaces in light and dark.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::ReportingError;
use crate::axes;

/// Size of a plot in its own units; the page scales it.
const SIZE: (u32, u32) = (480, 320);
/// Room for the labels of the axes.
const LABELS: (u32, u32) = (64, 50);
const MARGIN: u32 = 10;
/// Replaced by the page's text colour.
const INK: RGBColor = RGBColor(0x11, 0x11, 0x11);
/// Replaced by the page's grid colour.
const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);
/// Colours that can be told apart, by people who see few of them too, on light and on dark.
pub(crate) const COLORS: [RGBColor; 3] =
    [RGBColor(0xd9, 0x5f, 0x02), RGBColor(0x2b, 0x8c, 0xbe), RGBColor(0x1b, 0x9e, 0x77)];

/// One line.
pub(crate) struct Series {
    pub name: &'static str,
    pub points: Vec<(f64, f64)>,
}

/// A plot of lines over common axes.
pub(crate) struct LineChart {
    pub what: &'static str,
    pub x_label: &'static str,
    pub y_label: &'static str,
    pub series: Vec<Series>,
    /// One unit is as long along both axes; otherwise the vertical axis starts at zero.
    pub one_scale: bool,
}

impl LineChart {
    /// The plot.
    ///
    /// # Errors
    /// [`ReportingError::Plot`].
    pub fn svg(&self) -> Result<String, ReportingError> {
        let mut svg = String::new();
        let drawn = self.draw(&SVGBackend::with_string(&mut svg, SIZE).into_drawing_area());
        drawn.map_err(|problem| ReportingError::Plot { what: self.what, problem: problem.to_string() })?;
        Ok(svg)
    }

    fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Box<dyn std::error::Error + '_>> {
        let [x, y] = self.ranges();
        let font = |size: u32| ("sans-serif", size).into_font().color(&INK);
        let mut chart = ChartBuilder::on(area)
            .margin(MARGIN)
            .x_label_area_size(LABELS.1)
            .y_label_area_size(LABELS.0)
            .build_cartesian_2d(x[0]..x[1], y[0]..y[1])?;
        chart
            .configure_mesh()
            .x_desc(self.x_label)
            .y_desc(self.y_label)
            .x_labels(5)
            .y_labels(5)
            .x_label_formatter(&short)
            .y_label_formatter(&short)
            .axis_style(INK)
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .label_style(font(15))
            .axis_desc_style(font(16))
            .draw()?;
        for (series, color) in self.series.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(LineSeries::new(series.points.iter().copied(), color.stroke_width(2)))?;
        }
        area.present()?;
        Ok(())
    }

    fn ranges(&self) -> [[f64; 2]; 2] {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let x = axes::around(points().map(|point| point.0), 0.02);
        let y = axes::around(points().map(|point| point.1), 0.05);
        if !self.one_scale {
            return [x, [0.0, y[1].max(1e-6)]];
        }
        let width = f64::from(SIZE.0 - LABELS.0 - 2 * MARGIN);
        let height = f64::from(SIZE.1 - LABELS.1 - 2 * MARGIN);
        axes::to_one_scale([x, y], (width, height))
    }
}

/// As many digits as a label needs.
fn short(value: &f64) -> String {
    // Adding zero makes a negative zero a plain one.
    ((value * 1e3).round() / 1e3 + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_is_an_svg_with_a_line_for_each_series() {
        let series =
            |name, step: f64| Series { name, points: (0..9).map(|i| (f64::from(i), step)).collect() };
        let chart = LineChart {
            what: "test",
            x_label: "frame",
            y_label: "mm",
            series: vec![series("a", 1.0), series("b", 2.0)],
            one_scale: false,
        };
        let svg = chart.svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("viewBox"), "{svg}");
        assert!(svg.contains("#D95F02") && svg.contains("#2B8CBE"), "{svg}");
    }

    #[test]
    fn a_plot_of_nothing_is_drawn_too() {
        let series = vec![Series { name: "none", points: Vec::new() }];
        let chart = LineChart { what: "test", x_label: "x", y_label: "y", series, one_scale: true };
        assert!(chart.svg().unwrap().contains("</svg>"));
    }
}
