//! An object store as a store: S3, Google Cloud Storage, Azure, memory.
//!
//! A request that fails on the way is made again after a while. A first write that answers "already there" may be our own,
//! its first reply lost: what lies there is then compared.

use crate::profile::profile;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::MicrosoftAzureBuilder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::memory::InMemory;
use object_store::path::Path as Key;
use object_store::{
    BackoffConfig, ClientOptions, Error, ObjectStore, ObjectStoreExt, PutMode, PutPayload, RetryConfig,
};
use rodsweep::results::{Entry, ResultsError, Store};
use std::fmt;
use std::future::Future;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant, SystemTime};
use tokio::runtime::{Builder, Runtime};

/// No request is made again after this time.
const RETRY_TIMEOUT: Duration = Duration::from_secs(90);
/// The first pause between two tries; each is twice as long as the one before.
const PAUSE: Duration = Duration::from_millis(100);
/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);
/// Of one request, a part of many megabytes included.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(300);
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// A place in an object store.
pub struct Objects {
    store: Arc<dyn ObjectStore>,
    prefix: Key,
    url: String,
    runtime: Runtime,
}

impl fmt::Debug for Objects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Objects({})", self.url)
    }
}

impl Objects {
    /// The store of an address; nothing is asked of it yet.
    pub fn open(place: &Path, url: &str) -> Result<Objects, ResultsError> {
        let address = |reason: String| ResultsError::Address { url: place.into(), reason };
        let (scheme, rest) = url.split_once("://").unwrap_or_default();
        let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        if bucket.is_empty() {
            return Err(address(format!("name a bucket, as in {scheme}://bucket/results")));
        }
        let prefix = Key::parse(prefix).map_err(|error| address(error.to_string()))?;
        let store = store(scheme, bucket).map_err(|error| address(words(&error)))?;
        let Some(store) = store else {
            return Err(address("known are s3://, gs://, az:// and file://".into()));
        };
        let runtime = Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|error| address(format!("the program cannot wait for a network: {error}")))?;
        Ok(Objects { store, prefix, url: url.into(), runtime })
    }

    fn key(&self, name: &str) -> Key {
        name.split('/').filter(|part| !part.is_empty()).fold(self.prefix.clone(), |key, part| key.join(part))
    }

    fn wait<T>(&self, future: impl Future<Output = Result<T, Error>>) -> Result<T, Error> {
        self.runtime.block_on(future)
    }

    fn failure(&self, name: &str, action: &'static str, error: &Error) -> ResultsError {
        let reason = words(error);
        match remedy(&reason) {
            Some(remedy) => ResultsError::Unreachable { url: self.url.clone().into(), reason: short(&reason), remedy },
            None => ResultsError::Io { path: self.path(name), action, reason },
        }
    }

    /// Whether what lies there are these bytes; `None`: nothing lies there.
    fn holds(&self, key: &Key, bytes: &[u8]) -> Result<Option<bool>, Error> {
        match self.wait(self.store.head(key)) {
            Ok(found) if found.size != bytes.len() as u64 => Ok(Some(false)),
            Ok(_) => self.wait(async { self.store.get(key).await?.bytes().await }).map(|there| Some(there == bytes)),
            Err(Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }
}

impl Store for Objects {
    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool, ResultsError> {
        let (key, payload) = (self.key(name), PutPayload::from(bytes.to_vec()));
        let (begin, mut pause) = (Instant::now(), PAUSE);
        loop {
            let put = self.store.put_opts(&key, payload.clone(), PutMode::Create.into());
            let error = match self.wait(put) {
                Ok(_) => return Ok(true),
                Err(Error::AlreadyExists { .. }) => {
                    let found = self.holds(&key, bytes).map_err(|error| self.failure(name, "reading", &error))?;
                    return Ok(found.unwrap_or(false));
                }
                Err(error) => error,
            };
            // The store's own retries leave out what may have been done already: a first write is not for twice.
            if is_final(&error) || begin.elapsed() > RETRY_TIMEOUT {
                return Err(self.failure(name, "writing", &error));
            }
            std::thread::sleep(pause);
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), ResultsError> {
        let put = self.wait(self.store.put(&self.key(name), PutPayload::from(bytes.to_vec())));
        put.map(|_| ()).map_err(|error| self.failure(name, "writing", &error))
    }

    fn get(&self, name: &str) -> Result<Option<Vec<u8>>, ResultsError> {
        let key = self.key(name);
        match self.wait(async { self.store.get(&key).await?.bytes().await }) {
            Ok(bytes) => Ok(Some(bytes.into())),
            Err(error @ Error::NotFound { .. }) if remedy(&words(&error)).is_none() => Ok(None),
            Err(error) => Err(self.failure(name, "reading", &error)),
        }
    }

    fn get_range(&self, name: &str, range: Range<u64>) -> Result<Vec<u8>, ResultsError> {
        let bytes = self.wait(self.store.get_range(&self.key(name), range));
        bytes.map(Into::into).map_err(|error| self.failure(name, "reading", &error))
    }

    fn head(&self, name: &str) -> Result<Option<Entry>, ResultsError> {
        match self.wait(self.store.head(&self.key(name))) {
            Ok(found) => {
                let modified = SystemTime::from(found.last_modified);
                Ok(Some(Entry { name: name.into(), size: found.size, modified, is_file: true }))
            }
            Err(Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(self.failure(name, "reading", &error)),
        }
    }

    fn list(&self, folder: &str) -> Result<Vec<Entry>, ResultsError> {
        let found = self.wait(self.store.list_with_delimiter(Some(&self.key(folder))));
        let found = found.map_err(|error| self.failure(folder, "listing", &error))?;
        let name = |key: &Key| key.filename().unwrap_or_default().to_owned();
        let folders = found.common_prefixes.iter().map(|key| Entry {
            name: name(key),
            size: 0,
            modified: SystemTime::UNIX_EPOCH,
            is_file: false,
        });
        let files = found.objects.iter().map(|file| Entry {
            name: name(&file.location),
            size: file.size,
            modified: file.last_modified.into(),
            is_file: true,
        });
        Ok(folders.chain(files).collect())
    }

    fn remove(&self, name: &str) -> Result<(), ResultsError> {
        match self.wait(self.store.delete(&self.key(name))) {
            Ok(()) | Err(Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(self.failure(name, "removing", &error)),
        }
    }

    fn rename(&self, from: &str, to: &str) -> Result<bool, ResultsError> {
        let missing = || ResultsError::Io { path: self.path(from), action: "moving", reason: "it is gone".into() };
        let bytes = self.get(from)?.ok_or_else(missing)?;
        let is_moved = self.create(to, &bytes)?;
        if is_moved {
            self.remove(from)?;
        }
        Ok(is_moved)
    }

    fn prepare(&self) -> Result<(), ResultsError> {
        Ok(())
    }

    fn is_remote(&self) -> bool {
        true
    }

    fn place(&self) -> PathBuf {
        self.url.clone().into()
    }

    fn path(&self, name: &str) -> PathBuf {
        format!("{}/{name}", self.url).into()
    }
}

/// Any of these says where keys come from, before the files of Amazon's tools do.
const HAVE_KEYS: [&str; 2] = ["AWS_ACCESS_KEY_ID", "AWS_WEB_IDENTITY_TOKEN_FILE"];
/// What a profile may say.
const PROFILE: [(&str, AmazonS3ConfigKey); 4] = [
    ("aws_access_key_id", AmazonS3ConfigKey::AccessKeyId),
    ("aws_secret_access_key", AmazonS3ConfigKey::SecretAccessKey),
    ("aws_session_token", AmazonS3ConfigKey::Token),
    ("region", AmazonS3ConfigKey::Region),
];

/// A bucket with the credentials of the environment; `None`: the scheme is not known.
fn store(scheme: &str, bucket: &str) -> Result<Option<Arc<dyn ObjectStore>>, Error> {
    if scheme == "memory" {
        return Ok(Some(memory(bucket)));
    }
    // Another library of the program may have chosen before; then that is used.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let backoff = BackoffConfig { init_backoff: PAUSE, max_backoff: LONGEST_PAUSE, base: 2.0 };
    let retry = RetryConfig { backoff, max_retries: 12, retry_timeout: RETRY_TIMEOUT };
    let client = ClientOptions::new().with_timeout(REQUEST_TIMEOUT).with_connect_timeout(CONNECT_TIMEOUT);
    Ok(Some(match scheme {
        "s3" => {
            let mut builder = AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retry);
            let asked = |name: &&str| std::env::var(name).ok();
            let mut endpoint = ["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"].iter().find_map(asked);
            if HAVE_KEYS.iter().find_map(asked).is_none() {
                let failure = |reason: String| Error::Generic { store: "S3", source: reason.into() };
                let mut profile = profile().map_err(failure)?;
                for (name, key) in PROFILE {
                    if let Some(value) = profile.remove(name).filter(|_| builder.get_config_value(&key).is_none()) {
                        builder = builder.with_config(key, value);
                    }
                }
                endpoint = endpoint.or(profile.remove("endpoint_url"));
            }
            // An endpoint without TLS, of a store in one's own network, is named so on purpose.
            let is_plain = endpoint.as_deref().is_some_and(|url| url.starts_with("http://"));
            let builder = builder.with_client_options(client.with_allow_http(is_plain));
            Arc::new(
                match endpoint {
                    Some(endpoint) => builder.with_endpoint(endpoint),
                    None => builder,
                }
                .build()?,
            )
        }
        "gs" => {
            let endpoint = std::env::var("GOOGLE_BASE_URL").ok();
            let client = client.with_allow_http(endpoint.is_some_and(|url| url.starts_with("http://")));
            let builder = GoogleCloudStorageBuilder::from_env().with_bucket_name(bucket).with_retry(retry);
            Arc::new(builder.with_client_options(client).build()?)
        }
        "az" => {
            let builder = MicrosoftAzureBuilder::from_env().with_container_name(bucket).with_retry(retry);
            Arc::new(builder.with_client_options(client).build()?)
        }
        _ => return Ok(None),
    }))
}

/// A bucket of this process.
fn memory(bucket: &str) -> Arc<dyn ObjectStore> {
    static BUCKETS: Mutex<Vec<(String, Arc<InMemory>)>> = Mutex::new(Vec::new());
    let mut buckets = BUCKETS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some((_, store)) = buckets.iter().find(|(name, _)| name == bucket) {
        return store.clone();
    }
    let store = Arc::new(InMemory::new());
    buckets.push((bucket.into(), store.clone()));
    store
}

/// Whether to ask again would get the same answer.
fn is_final(error: &Error) -> bool {
    let is_refused = matches!(
        error,
        Error::NotFound { .. }
            | Error::PermissionDenied { .. }
            | Error::Unauthenticated { .. }
            | Error::InvalidPath { .. }
            | Error::NotSupported { .. }
            | Error::NotImplemented { .. }
            | Error::UnknownConfigurationKey { .. }
    );
    is_refused || remedy(&words(error)).is_some_and(|remedy| remedy != NETWORK)
}

/// An error with its causes, each once.
fn words(error: &Error) -> String {
    let mut text = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(next) = cause {
        let more = next.to_string();
        if !text.contains(&more) {
            text += &format!(": {more}");
        }
        cause = next.source();
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The last cause alone; what is before tells of requests and retries.
fn short(reason: &str) -> String {
    const MOST: usize = 300;
    let text: String = reason.chars().take(MOST).collect();
    if text.len() < reason.len() { text + " ..." } else { text }
}

const NETWORK: &str = "check the network and, for a store of your own, AWS_ENDPOINT_URL";

/// What helps, for what users meet before the first byte.
fn remedy(reason: &str) -> Option<&'static str> {
    const REMEDIES: [(&[&str], &str); 4] = [
        (
            &["NoSuchBucket", "bucket does not exist", "ContainerNotFound", "container does not exist"],
            "there is no such bucket: make it first, or mend the address",
        ),
        (
            &["169.254.169.254", "metadata.google.internal", "Could not receive credentials", "CredentialsProvider"],
            "there are no credentials: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, GOOGLE_APPLICATION_CREDENTIALS, or \
             AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY",
        ),
        (
            &["InvalidAccessKeyId", "SignatureDoesNotMatch", "AccessDenied", "403 Forbidden", "401 Unauthorized"],
            "the store refuses these credentials: check them, and what they may do in the bucket",
        ),
        (&["error trying to connect", "dns error", "Connection refused", "tcp connect error", "unreachable"], NETWORK),
    ];
    REMEDIES.iter().find(|(marks, _)| marks.iter().any(|mark| reason.contains(mark))).map(|(_, remedy)| *remedy)
}
