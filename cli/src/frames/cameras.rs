//! Lists the cameras of this computer on Linux.

use std::path::{Path, PathBuf};

const LISTED: &str = "/sys/class/video4linux";

/// A connected camera.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Camera {
    /// Its device for `vocc receive`.
    pub camera: PathBuf,
    /// Its own name.
    pub name: String,
}

/// All cameras, by device number.
pub fn list() -> Vec<Camera> {
    list_in(Path::new(LISTED))
}

fn list_in(listed: &Path) -> Vec<Camera> {
    let entries = std::fs::read_dir(listed).into_iter().flatten().flatten();
    let mut numbered: Vec<(u32, Camera)> = entries
        .filter_map(|entry| {
            // Other entries are radios and similar devices.
            let number = entry.file_name().to_str()?.strip_prefix("video")?.parse().ok()?;
            let name = std::fs::read_to_string(entry.path().join("name")).unwrap_or_default();
            let camera = Camera {
                camera: format!("/dev/video{number}").into(),
                name: name.trim().to_owned(),
            };
            Some((number, camera))
        })
        .collect();
    numbered.sort_by_key(|(number, _)| *number);
    numbered.into_iter().map(|(_, camera)| camera).collect()
}

/// Advice if the named camera does not exist.
pub fn advice(cameras: &[Camera]) -> String {
    let each = cameras
        .iter()
        .map(|Camera { camera, name }| format!("{} ({name})", camera.display()));
    match &each.collect::<Vec<_>>()[..] {
        [] => "this computer has none; plug one in, or name an address such as rtsp://HOST/PATH".into(),
        names => format!("give one of {}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_are_listed_and_named() {
        let folder = tempfile::tempdir().expect("a folder");
        for (entry, name) in [
            ("video10", "Dashcam\n"),
            ("video2", "Webcam: front\n"),
            ("radio0", "FM\n"),
            ("video3", ""),
        ] {
            std::fs::create_dir(folder.path().join(entry)).expect("a folder");
            std::fs::write(folder.path().join(entry).join("name"), name).expect("a file");
        }
        let cameras = list_in(folder.path());
        let told = advice(&cameras);
        assert_eq!(
            told,
            "give one of /dev/video2 (Webcam: front), /dev/video3 (), /dev/video10 (Dashcam)"
        );
        assert!(list_in(&folder.path().join("none")).is_empty());
        assert!(advice(&[]).starts_with("this computer has none; plug one in"));
    }
}
