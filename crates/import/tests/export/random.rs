//! Random ladders: what they do is the same behind an export, and behind an import of it.
//!
//! `RUNGD_EXPORT_LADDERS=1000 RUNGD_EXPORT_SCANS=2000 cargo test --release -p rungd-import
//! export::random` is the long run; `RUNGD_EXPORT_SEED` gives other ladders.

use rungd_base::random::SplitMix64;
use rungd_test_support::run::load;
use rungd_test_support::setting::setting;

use super::generator::ladder;
use super::judge::Judge;

#[test]
fn random_ladders_do_the_same_behind_an_export_and_an_import() {
    let ladders = setting("RUNGD_EXPORT_LADDERS", 25);
    let scans = setting("RUNGD_EXPORT_SCANS", 60);
    let seed = setting("RUNGD_EXPORT_SEED", 1);
    let mut done = 0;
    for number in 0..ladders {
        let mut random = SplitMix64(seed * 1_000_003 + number);
        let text = ladder(&mut random);
        let program = load(&text).unwrap_or_else(|errors| panic!("{errors}\n{text}"));
        let name = format!("ladder {number}\n{text}");
        let judge = Judge { name: &name, program: &program, scans, step_ms_max: 40 };
        match judge.judge(&mut random) {
            Ok(()) => done += 1,
            // Products of many words.
            Err(refused) => {
                let is_large = refused.iter().all(|what| what.contains("beyond 64 bits"));
                assert!(is_large, "{}\n{text}", refused.join(", "));
            }
        }
    }
    assert!(done * 10 > ladders * 8, "{done} of {ladders} ladders are exported");
}
