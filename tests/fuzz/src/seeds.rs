//! Writes what each fuzz target begins from: `seeds CORPUS` makes a folder for every reader.

use rodsweep_fuzz::readers::READERS;
use std::path::PathBuf;

// Its functions count coverage, so it needs what libFuzzer counts with.
libfuzzer_sys::fuzz_target!(|_bytes: &[u8]| {});

fn main() -> std::io::Result<()> {
    let corpus = PathBuf::from(std::env::args().nth(1).expect("a folder for the corpus"));
    for reader in READERS {
        let folder = corpus.join(reader.name);
        std::fs::create_dir_all(&folder)?;
        for (number, bytes) in (reader.seeds)().into_iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{number}")), bytes)?;
        }
    }
    Ok(())
}
