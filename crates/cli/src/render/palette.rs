//! Colours that tell groups apart.

/// A colour for a group; neighbours in number are far apart in hue. Negative groups are grey.
///
/// Hues step by the golden angle, so that any number of groups stays distinct for as long as possible;
/// value and saturation alternate slowly.
#[must_use]
pub fn color_of_group(group: i32) -> [f64; 3] {
    if group < 0 {
        return [0.6; 3];
    }
    let hue = (f64::from(group) * 0.618_033_988_749_895 + 0.58).fract();
    let saturation = [0.52, 0.68, 0.42][group as usize / 7 % 3];
    let value = [0.95, 0.82][group as usize / 3 % 2];
    rgb_from_hsv(hue, saturation, value)
}

fn rgb_from_hsv(hue: f64, saturation: f64, value: f64) -> [f64; 3] {
    [5.0, 3.0, 1.0].map(|offset: f64| {
        let k = (offset + hue * 6.0) % 6.0;
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_twenty_colours_differ() {
        for a in 0..20 {
            for b in 0..a {
                let (p, q) = (color_of_group(a), color_of_group(b));
                let difference: f64 = (0..3).map(|channel| (p[channel] - q[channel]).abs()).sum();
                assert!(difference > 0.04, "{a} and {b} look alike: {difference}");
            }
        }
    }
}
