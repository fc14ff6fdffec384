//! The hasher of passwords: argon2 with one block of memory, which every hash uses.
//!
//! A hash needs 19 MB. Memory of this size and alignment that is freed is not used again by every
//! allocator, so a block for each password would grow the process without limit. Called by `users`,
//! on a thread for blocking work. A second password waits for the block.

use std::fmt;
use std::sync::Mutex;

use argon2::password_hash::PasswordHash;
use argon2::{Algorithm, Argon2, Block, Params, Version};

use rungd_base::locked::locked;

/// The longest salt, in bytes.
const SALT_BYTES_MAX: usize = 64;

/// The hasher.
#[derive(Default)]
pub(super) struct Hasher {
    memory: Mutex<Vec<Block>>,
}

impl fmt::Debug for Hasher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Hasher")
    }
}

impl Hasher {
    /// Whether a hash is that of this password.
    pub fn is_right(&self, password: &str, hash: &PasswordHash<'_>) -> bool {
        self.verified(password, hash).unwrap_or(false)
    }

    fn verified(
        &self,
        password: &str,
        hash: &PasswordHash<'_>,
    ) -> argon2::password_hash::Result<bool> {
        let (Some(salt), Some(expected)) = (hash.salt, hash.hash) else { return Ok(false) };
        let algorithm = Algorithm::try_from(hash.algorithm)?;
        let version = hash.version.map_or(Ok(Version::default()), Version::try_from)?;
        let params = Params::try_from(hash)?;
        let mut bytes = [0; SALT_BYTES_MAX];
        let salt = salt.decode_b64(&mut bytes)?;
        let count = params.block_count();
        let mut out = vec![0; expected.len()];
        let argon = Argon2::new(algorithm, version, params);
        let mut memory = locked(&self.memory);
        if memory.len() < count {
            *memory = vec![Block::default(); count];
        }
        argon.hash_password_into_with_memory(
            password.as_bytes(),
            salt,
            &mut out,
            &mut memory[..],
        )?;
        // The comparison of outputs takes the same time whatever they contain.
        Ok(argon2::password_hash::Output::new(&out)? == expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use argon2::PasswordHasher as _;
    use argon2::password_hash::SaltString;
    use argon2::password_hash::rand_core::OsRng;

    #[test]
    fn the_hasher_agrees_with_argon2_and_reuses_its_memory() {
        let hasher = Hasher::default();
        let kinds = [
            (Algorithm::Argon2id, Version::V0x13, Params::new(64, 2, 1, None)),
            (Algorithm::Argon2id, Version::V0x13, Params::new(256, 1, 2, Some(40))),
            (Algorithm::Argon2i, Version::V0x10, Params::new(32, 3, 1, Some(16))),
            (Algorithm::Argon2d, Version::V0x13, Params::new(128, 1, 1, None)),
        ];
        for _ in 0..2 {
            for (algorithm, version, params) in kinds.clone() {
                let argon = Argon2::new(algorithm, version, params.expect("valid"));
                let salt = SaltString::generate(&mut OsRng);
                let hash =
                    argon.hash_password(b"correct horse", &salt).expect("a hash").to_string();
                let hash = PasswordHash::new(&hash).expect("a hash");
                assert!(hasher.is_right("correct horse", &hash), "{hash}");
                assert!(!hasher.is_right("wrong horse", &hash), "{hash}");
            }
        }
        assert_eq!(locked(&hasher.memory).len(), 256, "the largest");
        let odd = PasswordHash::new("$pbkdf2$i=1$AAAAAAAAAAAAAAAAAAAAAA").expect("a form");
        assert!(!hasher.is_right("correct horse", &odd));
    }
}
