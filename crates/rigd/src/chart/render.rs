//! Draws a chart on a backend of plotters.

use std::ops::Range;

use plotters::backend::RGBPixel;
use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::{Axis, Chart, ChartError, Mark, Panel, Scale, Series, font};

/// Width of a chart, px.
const WIDTH_PX: u32 = 960;
/// Height of a panel, px.
const PANEL_PX: u32 = 320;
/// Tallest panel of equal scales, px.
const TALLEST_PX: u32 = 1280;
/// Space around the axes: margin on each side, below for x labels, left for y labels, above for the title; px.
const MARGIN_PX: u32 = 8;
const X_LABELS_PX: u32 = 34;
const Y_LABELS_PX: u32 = 64;
const TITLE_PX: u32 = 30;

/// Height of a legend, px: of a line, and around the lines.
const LEGEND_LINE_PX: u32 = 15;
const LEGEND_AROUND_PX: u32 = 26;
/// Lines of a legend that a panel of the usual height holds above its curves.
const LEGEND_LINES: u32 = 2;

/// Distance of stems at one place, px.
const STEM_PX: f64 = 1.5;

/// Parts of a pixel in an SVG: plotters rounds places to whole ones, which makes stairs of flat curves.
pub const SVG_SCALE: u32 = 10;
/// Pixels of a PNG for each of the sizes above: screens show more than 96 dots an inch.
const PNG_SCALE: u32 = 2;

/// Where a panel's axes are: pixels of the picture and the values at their ends.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Left and right, px.
    pub x_px: Range<i32>,
    /// Top and bottom, px.
    pub y_px: Range<i32>,
    /// Values at left and right.
    pub x: Range<f64>,
    /// Values at bottom and top.
    pub y: Range<f64>,
}

/// The chart as SVG and where its panels are; `None` for a panel without points.
pub fn svg(chart: &Chart) -> Result<(String, Vec<Option<Frame>>), ChartError> {
    let (width, height) = size_px(chart);
    let (parts_x, parts_y) = (SVG_SCALE * width, SVG_SCALE * height);
    let mut text = String::new();
    let frames = draw(chart, SVGBackend::with_string(&mut text, (parts_x, parts_y)), SVG_SCALE)?;
    // The same picture in pixels: the view box keeps the parts.
    let text = text.replacen(
        &format!("width=\"{parts_x}\" height=\"{parts_y}\""),
        &format!("width=\"{width}\" height=\"{height}\""),
        1,
    );
    Ok((text, frames))
}

/// The chart as rows of RGB and its width and height in pixels.
pub fn rgb(chart: &Chart) -> Result<(Vec<u8>, (u32, u32)), ChartError> {
    let (width, height) = size_px(chart);
    let (width, height) = (PNG_SCALE * width, PNG_SCALE * height);
    let mut pixels = vec![0; 3 * width as usize * height as usize];
    let backend = BitMapBackend::<RGBPixel>::with_buffer_and_format(&mut pixels, (width, height))
        .map_err(|error| ChartError::Draw(Box::new(error)))?;
    draw(chart, backend, PNG_SCALE)?;
    Ok((pixels, (width, height)))
}

fn size_px(chart: &Chart) -> (u32, u32) {
    (WIDTH_PX, chart.panels.iter().map(height_px).sum::<u32>().max(1))
}

/// A panel of equal scales is as tall as its points ask for.
fn height_px(panel: &Panel) -> u32 {
    match bounds(panel) {
        Some((x, y)) if panel.scale == Scale::Equal => {
            let width = f64::from(WIDTH_PX - 2 * MARGIN_PX - Y_LABELS_PX);
            let around = f64::from(2 * MARGIN_PX + X_LABELS_PX + TITLE_PX);
            let height = around + width * (y.end - y.start) / (x.end - x.start);
            // The clamp keeps it in the range of u32.
            height.clamp(f64::from(PANEL_PX), f64::from(TALLEST_PX)) as u32
        }
        _ => PANEL_PX + LEGEND_LINE_PX * legend_lines(panel).saturating_sub(LEGEND_LINES),
    }
}

fn legend_lines(panel: &Panel) -> u32 {
    // A picture has a handful.
    panel.series.len() as u32
}

/// Share of the height of the axes that the legend takes, above the curves.
fn legend_share(panel: &Panel) -> f64 {
    let lines = legend_lines(panel);
    let legend = LEGEND_LINE_PX * lines + LEGEND_AROUND_PX;
    let height = PANEL_PX + LEGEND_LINE_PX * lines.saturating_sub(LEGEND_LINES);
    f64::from(legend) / f64::from(height - 2 * MARGIN_PX - X_LABELS_PX - TITLE_PX)
}

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn draw<DB: DrawingBackend>(chart: &Chart, backend: DB, scale: u32) -> Result<Vec<Option<Frame>>, ChartError>
where
    DB::ErrorType: 'static,
{
    font::register();
    let panels = || -> Result<_, Failure> {
        let mut rest = backend.into_drawing_area();
        rest.fill(&WHITE)?;
        let mut frames = Vec::new();
        for one in &chart.panels {
            let (area, below) = rest.split_vertically(scale * height_px(one));
            frames.push(panel(&area, one, scale)?);
            rest = below;
        }
        rest.present()?;
        Ok(frames)
    };
    panels().map_err(ChartError::Draw)
}

/// The points where they stand on the axes.
fn finite(series: &Series, scale: Scale) -> impl Iterator<Item = (f64, f64)> {
    let placed = series.points.iter().map(move |(x, y)| (*x, scale.height(*y)));
    placed.filter(|(x, y)| x.is_finite() && y.is_finite())
}

impl Scale {
    /// Where a value stands on the vertical axis; not finite where it has no place.
    pub(super) fn height(self, y: f64) -> f64 {
        match self {
            Self::Free | Self::Equal => y,
            Self::Logarithmic => y.log10(),
        }
    }

    /// What stands beside a place on the vertical axis.
    fn label(self, at: f64, decimals: usize) -> String {
        match self {
            Self::Free | Self::Equal => number(at, decimals),
            // Powers of ten alone: what stands between them is told by the distance.
            Self::Logarithmic if (at - at.round()).abs() > 1e-6 => String::new(),
            Self::Logarithmic if at < -3.5 => format!("{:.0e}", 10_f64.powf(at)),
            Self::Logarithmic => 10_f64.powf(at.round()).to_string(),
        }
    }
}

/// Ranges of the axes with their margins; `None` without points.
fn bounds(panel: &Panel) -> Option<(Range<f64>, Range<f64>)> {
    let reach = |value: fn((f64, f64)) -> f64| {
        let values = panel.series.iter().flat_map(|series| finite(series, panel.scale)).map(value);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let (low, high) = reach(|(_, y)| y);
    let (left, right) = if panel.x == Axis::Turn { (0.0, 360.0) } else { reach(|(x, _)| x) };
    if low > high || left > right {
        return None;
    }
    // A flat curve gets a range around it, wide enough that labels differ.
    let margin = |low: f64, high: f64, share: f64| {
        let span = high - low;
        let flat = 1e-3 * high.abs().max(low.abs());
        share * if span > 1e-9 * flat { span } else { flat.max(1.0) }
    };
    let y_margin = margin(low, high, 0.06);
    let x_margin = match &panel.x {
        Axis::Turn => 0.0,
        Axis::Fitted(_) => margin(left, right, 0.02),
    };
    // Above the curves: room for the legend, share = headroom/(curves + margin + headroom).
    let headroom = match panel.scale {
        Scale::Equal => y_margin,
        Scale::Free | Scale::Logarithmic => {
            let share = legend_share(panel);
            share / (1.0 - share) * (high - low + y_margin).max(y_margin)
        }
    };
    Some((left - x_margin..right + x_margin, low - y_margin..high + headroom))
}

/// Widens one of the ranges so that a unit is as long on both axes.
fn equalise((x, y): (Range<f64>, Range<f64>), (width, height): (u32, u32), scale: u32) -> (Range<f64>, Range<f64>) {
    let width = f64::from(width.saturating_sub(scale * (2 * MARGIN_PX + Y_LABELS_PX)).max(1));
    let height = f64::from(height.saturating_sub(scale * (2 * MARGIN_PX + X_LABELS_PX)).max(1));
    let a_pixel = ((x.end - x.start) / width).max((y.end - y.start) / height);
    let widen = |range: Range<f64>, pixels: f64| {
        let (middle, half) = (0.5 * (range.start + range.end), 0.5 * a_pixel * pixels);
        middle - half..middle + half
    };
    (widen(x, width), widen(y, height))
}

/// A label; what rounds to 0 has no sign.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|byte| matches!(byte, b'0' | b'.')) => zero.to_owned(),
        _ => text,
    }
}

/// Decimals that tell the labels of a range apart.
fn decimals(range: &Range<f64>) -> usize {
    // Six are enough for any quantity that is drawn.
    (1.0 - (range.end - range.start).log10()).ceil().clamp(0.0, 6.0) as usize
}

fn panel<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, panel: &Panel, scale: u32) -> Result<Option<Frame>, Failure>
where
    DB::ErrorType: 'static,
{
    let Some(mut ranges) = bounds(panel) else { return Ok(None) };
    // The font reaches above the line that plotters allots to a title.
    let area = area.margin(6 * scale, 0, 0, 0).titled(&panel.title, (font::SANS, 18 * scale))?;
    if panel.scale == Scale::Equal {
        ranges = equalise(ranges, area.dim_in_pixel(), scale);
    }
    let (x, y) = ranges;
    let mut builder = ChartBuilder::on(&area);
    builder.margin(scale * MARGIN_PX).x_label_area_size(scale * X_LABELS_PX).y_label_area_size(scale * Y_LABELS_PX);
    let (x_px, y_px) = match &panel.x {
        Axis::Turn => {
            // The label of the full turn stands at its very end.
            let mut chart = builder.build_cartesian_2d((x.start..x.end + 1e-6).step(45.0), y.clone())?;
            fill(&mut chart, panel, "θ1 / °", (0, decimals(&y)), scale)?
        }
        Axis::Fitted(label) => {
            let mut chart = builder.build_cartesian_2d(x.clone(), y.clone())?;
            fill(&mut chart, panel, label, (decimals(&x), decimals(&y)), scale)?
        }
    };
    Ok(Some(Frame { x_px, y_px, x, y }))
}

/// Draws axes, series and legend; gives back where the axes are, px.
fn fill<'a, DB, X>(
    chart: &mut ChartContext<'a, DB, Cartesian2d<X, RangedCoordf64>>,
    panel: &Panel,
    x_label: &str,
    (x_decimals, y_decimals): (usize, usize),
    scale: u32,
) -> Result<(Range<i32>, Range<i32>), Failure>
where
    DB: DrawingBackend + 'a,
    DB::ErrorType: 'static,
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    // Plotters takes lengths of marks as i32.
    let px = scale as i32;
    let text = (font::SANS, 12 * scale);
    let bottom = chart.as_coord_spec().y_spec().range().start;
    chart
        .configure_mesh()
        .label_style(text)
        .axis_desc_style(text)
        .set_all_tick_mark_size(5 * scale)
        .axis_style(BLACK.stroke_width(scale))
        .x_desc(x_label)
        .y_desc(panel.y_label.as_str())
        .x_labels(9)
        .x_label_formatter(&|value| number(*value, x_decimals))
        .y_label_formatter(&|value| panel.scale.label(*value, y_decimals))
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12).stroke_width(scale))
        .draw()?;
    // Stems of several series at one place stand side by side.
    let stems = panel.series.iter().filter(|series| series.mark == Mark::Stems).count() as f64;
    let x_range = chart.as_coord_spec().x_spec().range();
    let a_pixel = (x_range.end - x_range.start) / f64::from(chart.plotting_area().dim_in_pixel().0.max(1));
    let mut aside = -0.5 * (stems - 1.0) * STEM_PX * f64::from(scale) * a_pixel;
    for series in &panel.series {
        let colour = series.ink.colour();
        let (every, size, style) = match series.mark {
            Mark::Line => {
                let style = colour.stroke_width(scale);
                chart
                    .draw_series(LineSeries::new(finite(series, panel.scale), style))?
                    .label(series.name.as_str())
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 20 * px, y)], style));
                continue;
            }
            Mark::Stems => {
                let style = colour.stroke_width(scale);
                let shift = aside;
                aside += STEM_PX * f64::from(scale) * a_pixel;
                let stem = |(x, y): (f64, f64)| PathElement::new([(x + shift, bottom), (x + shift, y)], style);
                chart
                    .draw_series(finite(series, panel.scale).map(stem))?
                    .label(series.name.as_str())
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 20 * px, y)], style));
                continue;
            }
            Mark::Rings(every) => (every.max(1), 3 * px, colour.stroke_width(scale)),
            Mark::Dots => (1, px, colour.filled()),
        };
        chart
            .draw_series(finite(series, panel.scale).step_by(every).map(|point| Circle::new(point, size, style)))?
            .label(series.name.as_str())
            .legend(move |(x, y)| Circle::new((x + 10 * px, y), 3 * px, style));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperMiddle)
        .label_font(text)
        .legend_area_size(30 * px)
        .margin(10 * scale)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.2).stroke_width(scale))
        .draw()?;
    Ok(chart.plotting_area().get_pixel_range())
}
