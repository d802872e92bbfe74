//! Weights of 16 bits a number: half the file, for what is shipped.
//!
//! In: a weights file. Out: the same with its numbers rounded to 16 bits, or widened to 32 again, which every network computes
//! with. A training keeps 32: what it adds a step would be lost in the rounding.

use crate::WeightsError;
use crate::weights::{file, parts};
use burn::tensor::f16;
use serde_json::{Value, json};
use std::borrow::Cow;

/// Names of the two in a header.
const WIDE: &str = "F32";
const HALF: &str = "F16";

/// The file with every number of 32 bits rounded to the nearest of 16. Errors: no weights file, or a number beyond ±65,504.
pub fn halved(bytes: &[u8]) -> Result<Vec<u8>, WeightsError> {
    let rounded = |tensor: &str, number: &[u8], out: &mut Vec<u8>| {
        let value = f32::from_le_bytes(number.try_into().expect("four bytes"));
        let half = f16::from_f32(value);
        if !half.is_finite() {
            return Err(WeightsError::Range { tensor: tensor.to_owned(), value });
        }
        out.extend(half.to_le_bytes());
        Ok(())
    };
    let file = converted::<4>(bytes, [WIDE, HALF], &rounded)?;
    Ok(file.unwrap_or_else(|| bytes.to_vec()))
}

/// The file with every number of 16 bits as one of 32; as it is where there is none.
pub(crate) fn widened(bytes: &[u8]) -> Result<Cow<'_, [u8]>, WeightsError> {
    let wide = |_: &str, number: &[u8], out: &mut Vec<u8>| {
        let half = f16::from_le_bytes(number.try_into().expect("two bytes"));
        out.extend(half.to_f32().to_le_bytes());
        Ok(())
    };
    Ok(converted::<2>(bytes, [HALF, WIDE], &wide)?.map_or(Cow::Borrowed(bytes), Cow::Owned))
}

/// How a number of a named tensor is written anew.
type Number<'a> = &'a dyn Fn(&str, &[u8], &mut Vec<u8>) -> Result<(), WeightsError>;

/// The file with its tensors of one kind, numbers of `SIZE` bytes, as another kind; `None` where it has none of them.
fn converted<const SIZE: usize>(
    bytes: &[u8],
    [from, to]: [&str; 2],
    number: Number<'_>,
) -> Result<Option<Vec<u8>>, WeightsError> {
    let (mut header, data) = parts(bytes)?;
    let wrong = |what: &str| WeightsError::Format(what.to_owned());
    let entries = header.as_object_mut().ok_or_else(|| wrong("its header is no table"))?;
    let mut tensors: Vec<(&String, &mut Value)> =
        entries.iter_mut().filter(|(name, _)| *name != "__metadata__").collect();
    if !tensors.iter().any(|(_, t)| t["dtype"] == from) {
        return Ok(None);
    }
    let place = |tensor: &Value| {
        let at =
            |i: usize| tensor["data_offsets"][i].as_u64().and_then(|o| usize::try_from(o).ok());
        let range = at(0)?..at(1)?;
        data.get(range.clone()).map(|numbers| (range.start, numbers))
    };
    let mut placed = Vec::with_capacity(tensors.len());
    for (name, tensor) in &mut tensors {
        let (start, numbers) =
            place(tensor).ok_or_else(|| wrong(&format!("`{name}` lies outside the file")))?;
        placed.push((start, name.as_str(), &mut **tensor, numbers));
    }
    // A header may name the same numbers many times, to take memory.
    let named: usize = placed.iter().map(|p| p.3.len()).sum();
    if named > data.len() {
        return Err(wrong("its tensors overlap"));
    }
    placed.sort_by_key(|p| p.0);
    let mut out = Vec::with_capacity(named * 2);
    for (_, name, tensor, numbers) in placed {
        let start = out.len();
        if tensor["dtype"] == from {
            tensor["dtype"] = json!(to);
            for n in numbers.chunks(SIZE) {
                if n.len() < SIZE {
                    return Err(wrong(&format!("`{name}` ends within a number")));
                }
                number(name, n, &mut out)?;
            }
        } else {
            out.extend(numbers);
        }
        tensor["data_offsets"] = json!([start, out.len()]);
    }
    Ok(Some(file(&header, &out)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weights::{from_bytes, metadata, to_bytes};
    use burn::nn::{Linear, LinearConfig};
    use burn::tensor::Device;

    fn layer(seed: u64) -> Linear {
        let device = Device::flex();
        device.seed(seed);
        LinearConfig::new(7, 5).init(&device)
    }

    fn numbers(layer: &Linear) -> Vec<f32> {
        let bias = layer.bias.as_ref().map(|b| crate::floats(b.val())).unwrap_or_default();
        [crate::floats(layer.weight.val()), bias].concat()
    }

    #[test]
    fn halves_are_read_as_the_nearest_numbers_and_the_words_stay() {
        let words = [("kind".to_owned(), "test".to_owned())].into();
        // Made once: the device's generator is one for all tests.
        let kept = layer(4);
        let whole = to_bytes(&kept, &words).unwrap();
        let half = halved(&whole).unwrap();
        assert_eq!(whole.len() - half.len(), 2 * numbers(&kept).len());
        assert_eq!(metadata(&half).unwrap(), metadata(&whole).unwrap());
        let mut read = layer(5);
        from_bytes(&mut read, &half).unwrap();
        for (got, was) in numbers(&read).into_iter().zip(numbers(&kept)) {
            assert_eq!(got, f16::from_f32(was).to_f32());
            assert!((got - was).abs() <= was.abs() / 2048.0 + 1e-7);
        }
        // What was rounded once stays as it is.
        assert_eq!(halved(&half).unwrap(), half);
        assert_eq!(halved(&to_bytes(&read, &words).unwrap()).unwrap(), half);
    }

    #[test]
    fn a_number_beyond_sixteen_bits_is_named() {
        let mut large = layer(4);
        large.weight = large.weight.map(|w| w * 1e6);
        let refused = halved(&to_bytes(&large, &[].into()).unwrap()).unwrap_err();
        assert!(refused.to_string().starts_with("`weight` holds"), "{refused}");
    }

    #[test]
    fn damage_is_named_and_takes_no_memory() {
        let half = halved(&to_bytes(&layer(4), &[].into()).unwrap()).unwrap();
        let (header, data) = parts(&half).unwrap();
        let text = header.to_string();
        let refused = |text: &str, data: &[u8]| {
            let bytes = [&(text.len() as u64).to_le_bytes()[..], text.as_bytes(), data].concat();
            from_bytes(&mut layer(5), &bytes).unwrap_err().to_string()
        };
        assert!(refused(&text, &data[..20]).contains("lies outside"));
        assert!(refused(&text.replace("[0,10]", "[0,9]"), data).contains("within a number"));
        assert!(refused(&text.replace("[0,10]", "[10,0]"), data).contains("lies outside"));
        assert!(refused(&text.replace("[0,10]", "[0,80]"), data).contains("overlap"));
        assert!(refused("[1]", data).contains("no table"));
    }
}
