//! Digests of samples and objects.

/// Digest of a sample or of an object, 16 bytes.
pub(crate) type Digest = [u8; 16];

/// Hashes bytes as Alembic hashes samples: MurmurHash3 for 64-bit machines, 128 bits, seed 0.
pub(crate) fn digest(bytes: &[u8]) -> Digest {
    let (low, high) = mur3::murmurhash3_x64_128(bytes, 0);
    let mut digest = [0; 16];
    digest[..8].copy_from_slice(&low.to_le_bytes());
    digest[8..].copy_from_slice(&high.to_le_bytes());
    digest
}

/// Adds a digest to an accumulated one. The order matters.
pub(crate) fn chain(accumulated: &Digest, next: &Digest) -> Digest {
    let mut both = [0; 32];
    both[..16].copy_from_slice(accumulated);
    both[16..].copy_from_slice(next);
    digest(&both)
}
