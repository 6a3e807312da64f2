//! Finds the library of ONNX Runtime on this machine, if a config does not name it.
//!
//! It is the one that the variable ORT_DYLIB_PATH names, or the one that `pip install onnxruntime` put into a Python
//! environment: the active one, that of the `python3` on the path, or the user's own. Nothing is loaded here.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// The path of a library, or `None` if none was found.
pub(crate) fn find() -> Option<PathBuf> {
    let named = env::var_os("ORT_DYLIB_PATH").filter(|path| !path.is_empty());
    named.map(PathBuf::from).or_else(|| {
        python_prefixes()
            .iter()
            .find_map(|prefix| below_prefix(prefix))
    })
}

/// The folders of Python environments. The active one comes first.
fn python_prefixes() -> Vec<PathBuf> {
    let active = ["VIRTUAL_ENV", "CONDA_PREFIX"]
        .into_iter()
        .filter_map(env::var_os)
        .map(PathBuf::from);
    let path = env::var_os("PATH").unwrap_or_default();
    let on_path = env::split_paths(&path)
        .find(|folder| folder.join("python3").exists())
        .and_then(|folder| folder.parent().map(Path::to_owned));
    let of_user = env::var_os("HOME").map(|home| PathBuf::from(home).join(".local"));
    active.chain(on_path).chain(of_user).collect()
}

/// The library in the packages of a Python environment.
fn below_prefix(prefix: &Path) -> Option<PathBuf> {
    let of_version = |folder: &PathBuf| {
        let name = folder
            .file_name()
            .map(|name| name.to_string_lossy().into_owned());
        name.is_some_and(|name| name.starts_with("python3"))
    };
    let mut versions: Vec<PathBuf> = entries(&prefix.join("lib"))
        .into_iter()
        .filter(of_version)
        .collect();
    // `Lib` has no folder per version on Windows.
    versions.push(prefix.join("Lib"));
    versions.iter().find_map(|version| {
        ["site-packages", "dist-packages"]
            .iter()
            .find_map(|packages| library_in(&version.join(packages).join("onnxruntime/capi")))
    })
}

/// The library in the folder of the Python package. Its name may end with a version. Libraries of providers have other names.
fn library_in(folder: &Path) -> Option<PathBuf> {
    let start = format!("{}onnxruntime", env::consts::DLL_PREFIX);
    let is_library = |file: &PathBuf| {
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let rest = name.strip_prefix(&start);
        rest.is_some_and(|rest| rest.starts_with('.') && rest.contains(env::consts::DLL_SUFFIX))
    };
    entries(folder).into_iter().find(is_library)
}

/// The entries of a folder, beginning with the last name. It is empty if the folder cannot be listed.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let Ok(listed) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = listed.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths.reverse();
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_of_the_python_package_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let prefix = folder.path();
        assert_eq!(below_prefix(prefix), None);

        let capi = prefix.join("lib/python3.11/site-packages/onnxruntime/capi");
        fs::create_dir_all(&capi).unwrap();
        let library = |end: &str| {
            let [start, suffix] = [env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX];
            capi.join(format!("{start}onnxruntime{end}{suffix}"))
        };
        fs::write(library("_providers_shared"), "").unwrap();
        assert_eq!(below_prefix(prefix), None);
        fs::write(library(""), "").unwrap();
        assert_eq!(below_prefix(prefix), Some(library("")));
        fs::create_dir_all(prefix.join("lib/python3.12/site-packages")).unwrap();
        assert_eq!(below_prefix(prefix), Some(library("")));
    }
}
