//! The configuration of every program: `config/server.toml` built in, a file over it, single values over both.
//!
//! A program reads the sections that it needs into its own types; that a file or a single value sets something that
//! exists is checked here, against the defaults, so that a slip of the pen is told whoever reads the section.

use std::path::{Path, PathBuf};

use config::{Config as Layers, File, FileFormat};
use serde::de::DeserializeOwned;
use toml::{Table, Value};

/// The defaults, the same text that documents them.
const DEFAULTS: &str = include_str!("../../../config/server.toml");

/// A configuration that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// `--set` without a key or a value.
    #[error("--set {0}: expected section.key=value")]
    Override(String),
    /// A file that cannot be read.
    #[error("configuration {}: {source}", .file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file that is no TOML.
    #[error("configuration {}: {source}", .file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// What is wrong, and where.
        source: Box<toml::de::Error>,
    },
    /// An option that does not exist.
    #[error("configuration: there is no option {key} (in {layer})")]
    Unknown {
        /// Its full name.
        key: String,
        /// The file or argument that sets it.
        layer: String,
    },
    /// A value of the wrong kind or out of range.
    #[error("configuration{}: {source}", .file.as_ref().map(|f| format!(" ({})", f.display())).unwrap_or_default())]
    Value {
        /// The file laid over the defaults, if any.
        file: Option<PathBuf>,
        /// What is wrong; names the key.
        source: Box<config::ConfigError>,
    },
}

/// The sections that `T` holds: the defaults, with `file` and then `overrides` (`section.key=value`) laid over them.
///
/// # Errors
/// [`SettingsError`] names the key or file.
pub fn load<T: DeserializeOwned>(file: Option<&Path>, overrides: &[String]) -> Result<T, SettingsError> {
    load_over("", file, overrides)
}

/// As [`load`], with `profile`, a text like that of a file, between the defaults and the file.
///
/// # Errors
/// As [`load`].
pub fn load_over<T: DeserializeOwned>(
    profile: &str,
    file: Option<&Path>,
    overrides: &[String],
) -> Result<T, SettingsError> {
    let mut layers = vec![DEFAULTS.to_owned(), profile.to_owned()];
    if let Some(path) = file {
        layers.push(read_file(path)?);
    }
    for text in overrides {
        layers.push(override_as_toml(text)?);
    }
    let failed =
        |source| SettingsError::Value { file: file.map(Path::to_path_buf), source: Box::new(source) };
    let merged = layers
        .iter()
        .fold(Layers::builder(), |all, layer| all.add_source(File::from_str(layer, FileFormat::Toml)));
    merged.build().and_then(Layers::try_deserialize).map_err(failed)
}

fn read_file(path: &Path) -> Result<String, SettingsError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| SettingsError::Read { file: path.to_path_buf(), source })?;
    let table = text
        .parse()
        .map_err(|source| SettingsError::Syntax { file: path.to_path_buf(), source: Box::new(source) })?;
    check_known(&table, &path.display().to_string())?;
    Ok(text)
}

/// `section.key=value` as a line of TOML; what is no TOML value is taken as a text.
fn override_as_toml(text: &str) -> Result<String, SettingsError> {
    let malformed = || SettingsError::Override(text.into());
    let (key, value) = text.split_once('=').ok_or_else(malformed)?;
    let plain = format!("{key} = {value}");
    let quoted = format!("{key} = {}", Value::from(value.trim()));
    for line in [plain, quoted] {
        if let Ok(table) = line.parse() {
            check_known(&table, &format!("--set {text}"))?;
            return Ok(line);
        }
    }
    Err(malformed())
}

fn check_known(layer: &Table, name: &str) -> Result<(), SettingsError> {
    let defaults: Table = DEFAULTS.parse().expect("the built-in defaults are TOML; a test reads them");
    match unknown_key(layer, &defaults, "") {
        Some(key) => Err(SettingsError::Unknown { key, layer: name.to_owned() }),
        None => Ok(()),
    }
}

/// The full name of the first key that the defaults do not have.
fn unknown_key(layer: &Table, defaults: &Table, prefix: &str) -> Option<String> {
    layer.iter().find_map(|(key, value)| {
        let name = format!("{prefix}{key}");
        match (value, defaults.get(key)) {
            (_, None) => Some(name),
            (Value::Table(inner), Some(Value::Table(known))) => {
                unknown_key(inner, known, &format!("{name}."))
            }
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    struct Sections {
        quality: Quality,
        zenoh: Zenoh,
        gpu: Gpu,
    }

    #[derive(Debug, Deserialize)]
    struct Quality {
        dark_level: u8,
        sharpness_window: usize,
    }

    #[derive(Debug, Deserialize)]
    struct Zenoh {
        listen: Vec<String>,
    }

    #[derive(Debug, Deserialize)]
    struct Gpu {
        adapter: String,
    }

    fn overridden(texts: &[&str]) -> Result<Sections, SettingsError> {
        load(None, &texts.iter().map(|&text| text.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn single_values_win_over_files_and_files_over_defaults() {
        let file = tempfile::NamedTempFile::with_suffix(".toml").unwrap();
        std::fs::write(file.path(), "[quality]\ndark_level = 20\nsharpness_window = 9\n").unwrap();
        let sections: Sections = load(Some(file.path()), &["quality.dark_level=30".into()]).unwrap();
        assert_eq!((sections.quality.dark_level, sections.quality.sharpness_window), (30, 9));
    }

    #[test]
    fn a_profile_lies_between_the_defaults_and_the_file() {
        let file = tempfile::NamedTempFile::with_suffix(".toml").unwrap();
        std::fs::write(file.path(), "[quality]\ndark_level = 20\n").unwrap();
        let profile = "[quality]\ndark_level = 40\nsharpness_window = 9\n";
        let sections: Sections = load_over(profile, Some(file.path()), &[]).unwrap();
        assert_eq!((sections.quality.dark_level, sections.quality.sharpness_window), (20, 9));
    }

    #[test]
    fn lists_and_texts_can_be_set() {
        let sections = overridden(&["zenoh.listen=[\"tcp/[::1]:0\"]", "gpu.adapter=llvmpipe"]).unwrap();
        assert_eq!(sections.zenoh.listen, ["tcp/[::1]:0"]);
        assert_eq!(sections.gpu.adapter, "llvmpipe");
    }

    #[test]
    fn an_unknown_key_is_refused_by_name_whoever_reads_its_section() {
        for key in ["quality.darkness", "nonsense.dark_level", "recording.topics.middle_image"] {
            let error = overridden(&[&format!("{key}=3")]).unwrap_err();
            assert!(error.to_string().contains(key), "{error}");
        }
        let file = tempfile::NamedTempFile::with_suffix(".toml").unwrap();
        std::fs::write(file.path(), "[cart]\nlingering_s = 2.0\n").unwrap();
        let error = load::<Sections>(Some(file.path()), &[]).unwrap_err().to_string();
        assert!(error.contains("cart.lingering_s") && error.contains(".toml"), "{error}");
    }

    #[test]
    fn a_value_of_the_wrong_kind_is_refused_by_name() {
        let error = overridden(&["quality.dark_level=bright"]).unwrap_err();
        assert!(error.to_string().contains("dark_level"), "{error}");
    }

    #[test]
    fn an_override_without_a_value_and_a_missing_file_are_refused() {
        assert!(matches!(overridden(&["quality.dark_level"]), Err(SettingsError::Override(_))));
        let missing = load::<Sections>(Some(Path::new("missing.toml")), &[]).unwrap_err();
        assert!(missing.to_string().contains("missing.toml"), "{missing}");
    }
}
