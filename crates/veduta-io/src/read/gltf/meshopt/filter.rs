//! What is done to decoded attributes.
//!
//! KHR_meshopt_compression, appendix B. Numbers out of a filter's range, whose result the
//! specification leaves open, give some number and never a panic.

/// How decoded elements become those of the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Unit vectors, unfolded from an octahedron.
    Octahedral,
    /// Unit quaternions, without their largest component.
    Quaternion,
    /// Floating-point numbers, as exponent and mantissa.
    Exponential,
    /// Colours, as brightness and two differences.
    Color,
}

impl Filter {
    /// By the name it has in a document.
    pub fn of(name: &str) -> Option<Self> {
        Some(match name {
            "OCTAHEDRAL" => Self::Octahedral,
            "QUATERNION" => Self::Quaternion,
            "EXPONENTIAL" => Self::Exponential,
            "COLOR" => Self::Color,
            _ => return None,
        })
    }

    /// Filters elements of `stride` bytes: 4 or 8, and for exponents any multiple of 4.
    pub fn apply(self, bytes: &mut [u8], stride: usize) {
        match (self, stride) {
            (Self::Exponential, _) => {
                for number in bytes.as_chunks_mut::<4>().0 {
                    *number = exponential(i32::from_le_bytes(*number)).to_le_bytes();
                }
            }
            (Self::Quaternion, _) => {
                for element in bytes.as_chunks_mut::<8>().0 {
                    *element = to_words(quaternion(words(element)));
                }
            }
            (Self::Octahedral, 4) => {
                for element in bytes.as_chunks_mut::<4>().0 {
                    let parts = element.map(|byte| i32::from(byte as i8));
                    *element = octahedral(parts, 127.0).map(|part| part as i8 as u8);
                }
            }
            (Self::Octahedral, _) => {
                for element in bytes.as_chunks_mut::<8>().0 {
                    *element = to_words(octahedral(words(element), 32_767.0));
                }
            }
            (Self::Color, 4) => {
                for element in bytes.as_chunks_mut::<4>().0 {
                    let [y, co, cg, a] = *element;
                    let differences = [co, cg].map(|byte| i32::from(byte as i8));
                    let color = color(y.into(), differences, a.into(), 255.0);
                    *element = color.map(|part| part as u8);
                }
            }
            (Self::Color, _) => {
                for element in bytes.as_chunks_mut::<8>().0 {
                    let [y, co, cg, a] = words(element);
                    let unsigned = |part: i32| u32::from(part as u16);
                    let color = color(unsigned(y), [co, cg], unsigned(a), 65_535.0);
                    let parts = color.map(|part| (part as u16).to_le_bytes());
                    element.copy_from_slice(parts.as_flattened());
                }
            }
        }
    }
}

fn words(element: &[u8; 8]) -> [i32; 4] {
    let words = element.as_chunks::<2>().0;
    std::array::from_fn(|i| i16::from_le_bytes(words[i]).into())
}

fn to_words(parts: [f32; 4]) -> [u8; 8] {
    let words = parts.map(|part| (part as i16).to_le_bytes());
    std::array::from_fn(|i| words[i / 2][i % 2])
}

fn octahedral([x, y, one, rest]: [i32; 4], most: f32) -> [f32; 4] {
    let (x, y) = (x as f32 / one as f32, y as f32 / one as f32);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half is folded outwards.
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let scale = most / (x * x + y * y + z * z).sqrt();
    let round = |part: f32| (part * scale).round();
    [round(x), round(y), round(z), rest as f32]
}

fn quaternion([x, y, z, last]: [i32; 4]) -> [f32; 4] {
    let one = (last | 3) as f32;
    let [x, y, z] = [x, y, z].map(|part| part as f32 / one * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (last & 3) as usize;
    let mut parts = [0.0; 4];
    for (step, part) in [w, x, y, z].into_iter().enumerate() {
        parts[(largest + step) % 4] = (part * 32_767.0).round();
    }
    parts
}

fn exponential(code: i32) -> f32 {
    let (exponent, mantissa) = (code >> 24, code << 8 >> 8);
    // 2^exponent, exactly; the legal range is -100 to 100.
    let scale = f32::from_bits((exponent.clamp(-126, 127) + 127) as u32 * (1 << 23));
    scale * mantissa as f32
}

/// `y` and `a` are unsigned numbers of so many bits as the highest bit of `a` tells; the differences
/// are signed.
fn color(y: u32, [co, cg]: [i32; 2], a: u32, most: f32) -> [f32; 4] {
    let y = y as i32;
    let all_set = 2i64.pow(a.checked_ilog2().map_or(0, |highest| highest + 1)) - 1;
    let alpha = i64::from(a) & (all_set >> 1);
    let alpha = alpha << 1 | alpha & 1;
    let scale = most / all_set as f32;
    let round = |part: f32| (part * scale).round();
    [
        round((y + co - cg) as f32),
        round((y + cg) as f32),
        round((y - co - cg) as f32),
        round(alpha as f32),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_of_any_precision_are_unfolded() {
        // Ten bits: one is 511. (1, 0, 0), (0, 0, 1) and, folded, (0, 0, -1).
        for (folded, unfolded) in [
            ([511, 0, 511, 7], [32_767.0, 0.0, 0.0, 7.0]),
            ([0, 0, 511, 7], [0.0, 0.0, 32_767.0, 7.0]),
            ([511, 511, 511, 7], [0.0, 0.0, -32_767.0, 7.0]),
        ] {
            assert_eq!(octahedral(folded, 32_767.0), unfolded, "{folded:?}");
        }
    }

    #[test]
    fn a_quaternion_gets_its_largest_component_back() {
        // Half a turn about x, (1, 0, 0, 0): the largest component is the first.
        assert_eq!(quaternion([0, 0, 0, 32_764]), [32_767.0, 0.0, 0.0, 0.0]);
        // A quarter turn about z: w and z are equal, z is left out.
        let half = 32_767.0 * std::f32::consts::FRAC_1_SQRT_2;
        let turn = quaternion([32_767, 0, 0, 32_766]);
        assert!(
            (turn[3] - half).abs() <= 1.0 && (turn[2] - half).abs() <= 1.0,
            "{turn:?}"
        );
    }

    #[test]
    fn exponents_are_exact() {
        let code = |exponent: i32, mantissa: i32| exponent << 24 | mantissa & 0xff_ffff;
        assert_eq!(exponential(code(-2, 3)), 0.75);
        assert_eq!(exponential(code(-100, -1)), -(2f32.powi(-100)));
        assert_eq!(exponential(code(0, 0)), 0.0);
        assert!(exponential(code(127, -8_388_608)).is_infinite());
    }

    #[test]
    fn colours_come_back_from_their_differences() {
        // Eight bits, opaque: green is y + cg, red y + co - cg, blue y - co - cg.
        assert_eq!(
            color(100, [50, -20], 255, 255.0),
            [170.0, 80.0, 70.0, 255.0]
        );
        // Four bits scale to eight.
        assert_eq!(color(15, [0, 0], 15, 255.0), [255.0; 4]);
    }
}
