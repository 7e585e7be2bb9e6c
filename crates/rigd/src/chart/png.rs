//! A chart as pixels.

use super::{Chart, ChartError, render};

/// The chart as a PNG file, 8 bits a channel.
pub fn encode(chart: &Chart) -> Result<Vec<u8>, ChartError> {
    let (pixels, (width, height)) = render::rgb(chart)?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(file)
}
