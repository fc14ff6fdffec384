//! Damaged files: what no reader of a foreign form may answer with a panic.

use rungd_base::random::SplitMix64;

use crate::numbers::below;

/// What damages a file: signs of XML and of the languages, and letters of several bytes.
const DAMAGE: [&str; 21] = [
    "[", "]", "(", ")", ",", ".", ";", ":", "#", "%", "-", "<", ">", "0", "9", "a", "?", "&", "\"",
    "é", "€",
];

/// Twenty copies of a file, each with one to four mistakes: a sign in the place of a byte, a byte
/// that is missing, or an end that is cut off.
pub fn damaged(whole: &str, random: &mut SplitMix64) -> Vec<String> {
    (0..20).map(|_| one(whole, random)).collect()
}

fn one(whole: &str, random: &mut SplitMix64) -> String {
    let mut bytes = whole.as_bytes().to_vec();
    for _ in 0..1 + below(random, 4) {
        let at = below(random, bytes.len() as u64) as usize;
        match below(random, 3) {
            0 => {
                let damage = DAMAGE[below(random, DAMAGE.len() as u64) as usize];
                drop(bytes.splice(at..=at, damage.bytes()));
            }
            1 => drop(bytes.remove(at)),
            _ => bytes.truncate(bytes.len() - below(random, 9) as usize),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
