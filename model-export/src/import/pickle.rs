//! The pickle inside a file of `torch.save(model.state_dict())`, read by a machine that knows dictionaries,
//! tuples, texts, integers and tensors, and nothing that runs.
//!
//! A pickle is a program: Python's own reader calls whatever function it names. Here the names that a state
//! dict needs stand in one list, and any other one, and any other operation, is refused. Memory is bounded by
//! the pickle's length, since no operation makes more than one value. Nothing here panics.

use super::tensor::{NAME_BYTES_MAX, NumberFormat, TENSORS_MAX};
use std::collections::BTreeMap;

/// Most axes of a tensor whose shape is kept.
const AXES_MAX: usize = 8;

/// Why a pickle is not a state dict.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PickleError {
    /// It ends in its middle.
    #[error("the pickle ends in its middle")]
    Ends,
    /// An operation that no state dict needs.
    #[error("operation {code:#04x} at byte {at} of the pickle is none that a state dict needs")]
    Operation {
        /// Its code.
        code: u8,
        /// Where.
        at: usize,
    },
    /// Something else than tensors and dictionaries, of which nothing is ever made.
    #[error("the pickle names {0:?}, and nothing but tensors of floats is read")]
    Global(String),
    /// An operation on what is not there, or is something else.
    #[error("the operation at byte {at} of the pickle does not fit what comes before it")]
    Misfit {
        /// Where.
        at: usize,
    },
    /// A text that is not UTF-8, or too long for a name.
    #[error("a name at byte {at} of the pickle is no text of {NAME_BYTES_MAX} bytes at most")]
    Name {
        /// Where.
        at: usize,
    },
    /// More tensors than any network has.
    #[error("has more than {TENSORS_MAX} tensors")]
    Tensors,
    /// It is no dictionary of tensors, but perhaps holds one.
    #[error(
        "is no state dict: {0} is no tensor; save it with torch.save(model.state_dict(), FILE)"
    )]
    NotTensors(String),
}

/// A tensor as the pickle describes it; its numbers lie in a storage of their own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TensorRecord<'a> {
    /// Its name in the state dict.
    pub name: &'a str,
    /// What its numbers are.
    pub format: NumberFormat,
    /// Name of the storage.
    pub storage: &'a str,
    /// Place of the first number in the storage.
    pub offset: usize,
    /// Numbers along each axis.
    pub shape: Vec<usize>,
    /// Steps in the storage along each axis.
    pub strides: Vec<usize>,
}

/// What lies on the stack; what is larger than a word lies in a list beside it.
#[derive(Clone, Copy, Debug)]
enum Value<'a> {
    Nothing,
    Truth,
    Integer(i64),
    Text(&'a str),
    OrderedDict,
    RebuildTensor,
    StorageType(NumberFormat),
    Storage(NumberFormat, &'a str),
    Tuple(usize),
    Dictionary(usize),
    Tensor(usize),
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Value<'a>>,
    marks: Vec<usize>,
    memo: BTreeMap<u32, Value<'a>>,
    tuples: Vec<Vec<Value<'a>>>,
    dictionaries: Vec<Vec<[Value<'a>; 2]>>,
    tensors: Vec<TensorRecord<'a>>,
}

/// The tensors of the state dict in `pickle`, in its order.
///
/// # Errors
/// See [`PickleError`].
pub fn state_dict(pickle: &[u8]) -> Result<Vec<TensorRecord<'_>>, PickleError> {
    let mut machine = Machine {
        bytes: pickle,
        at: 0,
        stack: Vec::new(),
        marks: Vec::new(),
        memo: BTreeMap::new(),
        tuples: Vec::new(),
        dictionaries: Vec::new(),
        tensors: Vec::new(),
    };
    let result = loop {
        if let Some(result) = machine.operate()? {
            break result;
        }
    };
    let Value::Dictionary(place) = result else {
        return Err(PickleError::NotTensors("the whole".to_owned()));
    };
    let entries = machine.dictionaries.get(place).map(Vec::as_slice);
    let entries = entries.unwrap_or_default();
    // One tensor, memoised, can stand under any number of names.
    if entries.len() > TENSORS_MAX {
        return Err(PickleError::Tensors);
    }
    let records = entries.iter().map(|entry| match entry {
        [Value::Text(name), Value::Tensor(place)] => {
            let record = machine.tensors.get(*place).cloned();
            record.map(|record| TensorRecord { name, ..record })
        }
        .ok_or(PickleError::Ends),
        [Value::Text(name), _] => Err(PickleError::NotTensors(format!("{name:?}"))),
        _ => Err(PickleError::NotTensors(
            "an entry without a name".to_owned(),
        )),
    });
    records.collect()
}

impl<'a> Machine<'a> {
    /// Does what comes next; the result at the end.
    fn operate(&mut self) -> Result<Option<Value<'a>>, PickleError> {
        let at = self.at;
        let misfit = PickleError::Misfit { at };
        let [code] = *self.take::<1>()?;
        match code {
            // PROTO; every version's operations are told apart by their codes.
            0x80 => {
                self.take::<1>()?;
            }
            b'.' => return self.stack.pop().map(Some).ok_or(misfit),
            b'(' => self.marks.push(self.stack.len()),
            b'N' => self.stack.push(Value::Nothing),
            0x88 | 0x89 => self.stack.push(Value::Truth),
            b'K' => {
                let [byte] = *self.take()?;
                self.stack.push(Value::Integer(byte.into()));
            }
            b'M' => {
                let value = u16::from_le_bytes(*self.take()?);
                self.stack.push(Value::Integer(value.into()));
            }
            b'J' => {
                let value = i32::from_le_bytes(*self.take()?);
                self.stack.push(Value::Integer(value.into()));
            }
            b'X' => {
                let length = u32::from_le_bytes(*self.take()?) as usize;
                let text = self.text(length)?;
                self.stack.push(Value::Text(text));
            }
            b'c' => {
                let global = self.global()?;
                self.stack.push(global);
            }
            b'q' | b'r' | b'h' | b'j' => self.remember(code, misfit)?,
            b')' => self.tuple(0, misfit)?,
            0x85..=0x87 => self.tuple(usize::from(code - 0x84), misfit)?,
            b't' => {
                let start = self.marks.pop().ok_or(misfit.clone())?;
                let count = self.stack.len().checked_sub(start);
                self.tuple(count.ok_or(misfit.clone())?, misfit)?;
            }
            b'}' => self.dictionary(),
            b's' => self.set_items(2, misfit)?,
            b'u' => {
                let start = self.marks.pop().ok_or(misfit.clone())?;
                let count = self.stack.len().checked_sub(start);
                self.set_items(count.ok_or(misfit.clone())?, misfit)?;
            }
            b'Q' => {
                let id = self.stack.pop().and_then(|id| self.storage(id));
                self.stack.push(id.ok_or(misfit)?);
            }
            b'R' => self.call(misfit)?,
            // BUILD: what torch keeps beside the dictionary, its versions, is dropped.
            b'b' => match (self.stack.pop(), self.stack.last()) {
                (Some(Value::Dictionary(_)), Some(Value::Dictionary(_))) => {}
                _ => return Err(misfit),
            },
            code => return Err(PickleError::Operation { code, at }),
        }
        Ok(None)
    }

    fn take<const N: usize>(&mut self) -> Result<&'a [u8; N], PickleError> {
        let left = self.bytes.get(self.at..).unwrap_or_default();
        let taken = left.first_chunk().ok_or(PickleError::Ends)?;
        self.at += N;
        Ok(taken)
    }

    fn text(&mut self, length: usize) -> Result<&'a str, PickleError> {
        let at = self.at;
        if length > NAME_BYTES_MAX {
            return Err(PickleError::Name { at });
        }
        let left = self.bytes.get(at..).unwrap_or_default();
        let text = left.get(..length).ok_or(PickleError::Ends)?;
        self.at += length;
        str::from_utf8(text).map_err(|_| PickleError::Name { at })
    }

    /// Two lines: a module and a name in it.
    fn global(&mut self) -> Result<Value<'a>, PickleError> {
        let mut lines = [""; 2];
        for line in &mut lines {
            let left = self.bytes.get(self.at..).unwrap_or_default();
            let length = left.iter().position(|&byte| byte == b'\n');
            *line = self.text(length.ok_or(PickleError::Ends)?)?;
            self.at += 1;
        }
        match lines {
            ["collections", "OrderedDict"] => Ok(Value::OrderedDict),
            ["torch._utils", "_rebuild_tensor_v2"] => Ok(Value::RebuildTensor),
            ["torch", "HalfStorage"] => Ok(Value::StorageType(NumberFormat::F16)),
            ["torch", "FloatStorage"] => Ok(Value::StorageType(NumberFormat::F32)),
            ["torch", "DoubleStorage"] => Ok(Value::StorageType(NumberFormat::F64)),
            [module, name] => Err(PickleError::Global(format!("{module}.{name}"))),
        }
    }

    /// BINPUT and LONG_BINPUT, BINGET and LONG_BINGET.
    fn remember(&mut self, code: u8, misfit: PickleError) -> Result<(), PickleError> {
        let place = if matches!(code, b'q' | b'h') {
            let [byte] = *self.take()?;
            u32::from(byte)
        } else {
            u32::from_le_bytes(*self.take()?)
        };
        if matches!(code, b'q' | b'r') {
            let top = self.stack.last().copied().ok_or(misfit)?;
            self.memo.insert(place, top);
        } else {
            let value = self.memo.get(&place).copied().ok_or(misfit)?;
            self.stack.push(value);
        }
        Ok(())
    }

    /// The last `count` values, off the stack.
    fn pop_last(
        &mut self,
        count: usize,
        misfit: PickleError,
    ) -> Result<Vec<Value<'a>>, PickleError> {
        let start = self.stack.len().checked_sub(count).ok_or(misfit)?;
        Ok(self.stack.split_off(start))
    }

    fn tuple(&mut self, count: usize, misfit: PickleError) -> Result<(), PickleError> {
        let values = self.pop_last(count, misfit)?;
        self.stack.push(Value::Tuple(self.tuples.len()));
        self.tuples.push(values);
        Ok(())
    }

    fn dictionary(&mut self) {
        self.stack.push(Value::Dictionary(self.dictionaries.len()));
        self.dictionaries.push(Vec::new());
    }

    fn set_items(&mut self, count: usize, misfit: PickleError) -> Result<(), PickleError> {
        let values = self.pop_last(count, misfit.clone())?;
        let (pairs, []) = values.as_chunks::<2>() else {
            return Err(misfit);
        };
        let dictionary = match self.stack.last() {
            Some(Value::Dictionary(place)) => self.dictionaries.get_mut(*place),
            _ => None,
        };
        dictionary.ok_or(misfit)?.extend(pairs);
        Ok(())
    }

    /// What `("storage", type, name, place, length)` stands for.
    fn storage(&self, id: Value<'a>) -> Option<Value<'a>> {
        match (id, self.values(id)) {
            (
                _,
                Some(
                    [
                        Value::Text("storage"),
                        Value::StorageType(format),
                        Value::Text(name),
                        ..,
                    ],
                ),
            ) => Some(Value::Storage(*format, name)),
            _ => None,
        }
    }

    fn values(&self, tuple: Value<'a>) -> Option<&[Value<'a>]> {
        match tuple {
            Value::Tuple(place) => self.tuples.get(place).map(Vec::as_slice),
            _ => None,
        }
    }

    /// Non-negative integers, one for each of a few axes.
    fn sizes(&self, tuple: Value<'a>) -> Option<Vec<usize>> {
        let values = self.values(tuple)?;
        let sizes = values.iter().take(AXES_MAX + 1).map(|value| match value {
            Value::Integer(value) => usize::try_from(*value).ok(),
            _ => None,
        });
        (values.len() <= AXES_MAX).then(|| sizes.collect())?
    }

    /// REDUCE: the two calls that there are, and neither is one.
    fn call(&mut self, misfit: PickleError) -> Result<(), PickleError> {
        let (arguments, function) = (self.stack.pop(), self.stack.pop());
        let arguments = arguments.ok_or(misfit.clone())?;
        match (function, self.values(arguments)) {
            (Some(Value::OrderedDict), Some([])) => self.dictionary(),
            (
                Some(Value::RebuildTensor),
                Some(
                    [
                        Value::Storage(format, storage),
                        Value::Integer(offset),
                        shape,
                        strides,
                        ..,
                    ],
                ),
            ) => {
                let sizes = (self.sizes(*shape), self.sizes(*strides));
                let (Ok(offset), (Some(shape), Some(strides))) = (usize::try_from(*offset), sizes)
                else {
                    return Err(misfit);
                };
                let record = TensorRecord {
                    name: "",
                    format: *format,
                    storage,
                    offset,
                    shape,
                    strides,
                };
                if self.tensors.len() == TENSORS_MAX {
                    return Err(PickleError::Tensors);
                }
                self.stack.push(Value::Tensor(self.tensors.len()));
                self.tensors.push(record);
            }
            _ => return Err(misfit),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
