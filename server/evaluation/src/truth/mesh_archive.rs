//! Arrays of a `NumPy` archive, whatever their number type.

use std::io::{Cursor, Read};

use npyz::npz::NpzArchive;
use npyz::{Deserialize, NpyFile};

use crate::EvaluationError;

/// Most numbers in one array that are believed: 11 million vertices.
const NUMBERS_MAX: u64 = 1 << 25;

/// An opened archive.
pub(super) struct MeshArchive(NpzArchive<Cursor<Vec<u8>>>);

impl MeshArchive {
    pub(super) fn open(bytes: Vec<u8>) -> Result<Self, EvaluationError> {
        let archive = NpzArchive::new(Cursor::new(bytes));
        Ok(Self(archive.map_err(|error| EvaluationError::mesh("archive", error))?))
    }

    /// The numbers of an array in row order, and its shape.
    pub(super) fn numbers(&mut self, array: &str) -> Result<(Vec<f64>, Vec<u64>), EvaluationError> {
        let wrong = |problem: String| EvaluationError::mesh(array, problem);
        let file = self.0.by_name(array).map_err(|error| wrong(error.to_string()))?;
        let file = file.ok_or_else(|| wrong("not in the archive".into()))?;
        let shape = file.shape().to_vec();
        let length = shape.iter().try_fold(1u64, |product, &side| product.checked_mul(side));
        if length.is_none_or(|length| length > NUMBERS_MAX || length != file.len()) {
            return Err(wrong(format!("shape {shape:?} is more than {NUMBERS_MAX} numbers")));
        }
        if shape.len() > 1 && file.order() != npyz::Order::C {
            return Err(wrong("columns come first; rows are expected to".into()));
        }
        Ok((read_numbers(file).map_err(wrong)?, shape))
    }

    /// Numbers of a list without inner structure.
    pub(super) fn list(&mut self, array: &str) -> Result<Vec<f64>, EvaluationError> {
        Ok(self.numbers(array)?.0)
    }

    /// The only number of an array.
    pub(super) fn scalar(&mut self, array: &str) -> Result<f64, EvaluationError> {
        match self.list(array)?[..] {
            [value] => Ok(value),
            ref values => {
                Err(EvaluationError::mesh(array, format!("{} numbers, expected one", values.len())))
            }
        }
    }

    /// Rows of three numbers.
    pub(super) fn triples(&mut self, array: &str) -> Result<Vec<[f64; 3]>, EvaluationError> {
        let (numbers, _) = self.numbers(array)?;
        let (rows, rest) = numbers.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(EvaluationError::mesh(array, format!("{} numbers are no triples", numbers.len())));
        }
        Ok(rows.to_vec())
    }
}

/// Tries one number type after another.
macro_rules! first_type_that_fits {
    ($file:expr, $($number:ty),+) => {{
        let file = $file;
        $(let file = match file.try_data::<$number>() {
            Ok(numbers) => return collect(numbers, |number| number as f64),
            Err(file) => file,
        };)+
        Err(format!("numbers of type {} are not read", file.dtype().descr()))
    }};
}

fn read_numbers<R: Read>(file: NpyFile<R>) -> Result<Vec<f64>, String> {
    first_type_that_fits!(file, f64, f32, i64, i32, i16, u64, u32, u16, u8)
}

fn collect<T: Deserialize, R: Read>(
    numbers: npyz::NpyReader<T, R>,
    to_f64: impl Fn(T) -> f64,
) -> Result<Vec<f64>, String> {
    numbers.map(|number| number.map(&to_f64)).collect::<Result<_, _>>().map_err(|error| error.to_string())
}
