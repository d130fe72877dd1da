//! The cameras of this computer, as Linux lists them.

use std::path::{Path, PathBuf};

const LISTED: &str = "/sys/class/video4linux";

/// A camera that there is.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Camera {
    /// Its device, for `vocc receive`.
    pub camera: PathBuf,
    /// What it calls itself.
    pub name: String,
}

/// All of them, in the order of their numbers.
pub fn list() -> Vec<Camera> {
    list_in(Path::new(LISTED))
}

fn list_in(listed: &Path) -> Vec<Camera> {
    let entries = std::fs::read_dir(listed).into_iter().flatten().flatten();
    let mut numbered: Vec<(u32, Camera)> = entries
        .filter_map(|entry| {
            // Other entries are radios and the like.
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

/// What helps who has named none of these.
pub fn advice(cameras: &[Camera]) -> String {
    let each = cameras
        .iter()
        .map(|Camera { camera, name }| format!("{} ({name})", camera.display()));
    match &each.collect::<Vec<_>>()[..] {
        [] => "this computer has none; plug one in, or name an address such as rtsp://HOST/PATH".into(),
        names => format!("name one of {}", names.join(", ")),
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
            "name one of /dev/video2 (Webcam: front), /dev/video3 (), /dev/video10 (Dashcam)"
        );
        assert!(list_in(&folder.path().join("none")).is_empty());
        assert!(advice(&[]).starts_with("this computer has none; plug one in"));
    }
}
