//! Keys, region and endpoint from the files of Amazon's tools: `~/.aws/credentials` and `~/.aws/config`.

use std::collections::HashMap;
use std::path::PathBuf;

/// What a profile says, by name, such as `aws_access_key_id`.
pub type Profile = HashMap<String, String>;

/// What asks for keys that only Amazon's own tools can get.
const ELSEWHERE: [&str; 4] = ["sso_session", "sso_start_url", "role_arn", "credential_process"];

/// The profile that the environment names, or `default`; empty where the files are not there.
///
/// # Errors
///
/// A profile that is named and is in neither file, or whose keys have to be fetched first.
pub fn profile() -> Result<Profile, String> {
    let named = ["AWS_PROFILE", "AWS_DEFAULT_PROFILE"].iter().find_map(|name| variable(name));
    let name = named.as_deref().unwrap_or("default");
    let text = |variable, file| std::fs::read_to_string(path(variable, file)).unwrap_or_default();
    let credentials = text("AWS_SHARED_CREDENTIALS_FILE", "credentials");
    let config = text("AWS_CONFIG_FILE", "config");
    let section = if name == "default" { name.to_owned() } else { format!("profile {name}") };
    let (keys, settings) = (section_of(&credentials, name), section_of(&config, &section));
    if keys.is_none() && settings.is_none() && named.is_some() {
        return Err(format!("there is no profile \"{name}\" in ~/.aws/credentials or ~/.aws/config; mend AWS_PROFILE"));
    }
    let mut profile = settings.unwrap_or_default();
    profile.extend(keys.unwrap_or_default());
    match ELSEWHERE.iter().find(|key| profile.contains_key(**key)) {
        Some(key) if !profile.contains_key("aws_access_key_id") => Err(format!(
            "the keys of profile \"{name}\" have to be fetched first ({key}): \
             eval \"$(aws configure export-credentials --profile {name} --format env)\""
        )),
        _ => Ok(profile),
    }
}

/// The lines `key = value` of a section; `None`: it is not there. Indented lines belong to settings of services.
fn section_of(text: &str, name: &str) -> Option<Profile> {
    let mut found = None;
    let mut inside = false;
    for line in text.lines().filter(|line| !line.starts_with([' ', '\t', '#', ';'])) {
        if let Some(title) = line.strip_prefix('[').and_then(|line| line.split(']').next()) {
            inside = title.split_whitespace().eq(name.split_whitespace());
            if inside {
                found.get_or_insert_with(Profile::new);
            }
        } else if let (true, Some((key, value)), Some(profile)) = (inside, line.split_once('='), found.as_mut()) {
            profile.insert(key.trim().to_lowercase(), value.trim().to_owned());
        }
    }
    found
}

fn path(name: &str, file: &str) -> PathBuf {
    let home = || PathBuf::from(variable("HOME").or_else(|| variable("USERPROFILE")).unwrap_or_default());
    variable(name).map_or_else(|| home().join(".aws").join(file), PathBuf::from)
}

fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::section_of;

    #[test]
    fn a_section_holds_its_own_lines_alone() {
        let text = "[default]\naws_access_key_id = A\n# aws_secret_access_key = no\naws_secret_access_key=s=3=\n\
                    [profile lab]\nregion = eu-central-1\ns3 =\n  endpoint_url = http://no\n[empty]\n";
        let default = section_of(text, "default").expect("a section");
        assert_eq!(default.len(), 2);
        assert_eq!((default["aws_access_key_id"].as_str(), default["aws_secret_access_key"].as_str()), ("A", "s=3="));
        let lab = section_of(text, "profile lab").expect("a section");
        assert_eq!((lab["region"].as_str(), lab.get("endpoint_url")), ("eu-central-1", None));
        assert!(section_of(text, "empty").is_some_and(|section| section.is_empty()));
        assert!(section_of(text, "lab").is_none() && section_of("", "default").is_none());
    }
}
