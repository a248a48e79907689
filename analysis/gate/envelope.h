/// @file DSSE envelopes: a statement, signed by a key of the user.
///
/// DSSE v1 signs the bytes "DSSEv1 SIZE TYPE SIZE BODY", with sizes in decimal, so that a signature of one type of
/// document is none of another. Ed25519 signs them as they are, RSA (PKCS #1) and ECDSA their SHA-256; `openssl
/// pkeyutl` and `openssl dgst` verify the same bytes. Source: https://github.com/secure-systems-lab/dsse,
/// protocol.md.
#pragma once

#include <string>

#include "nn/base/json.h"

namespace swarmcert::gate {

/// Type of the statements that are signed.
inline constexpr char kStatementType[] = "application/vnd.in-toto+json";

/// Returns the envelope of `statement`: payload, payloadType, and one signature with the SHA-256 of the public key
/// (SubjectPublicKeyInfo, DER) as keyid.
/// @param private_key PEM file without passphrase.
/// @throws files::InputError if the key cannot be read or cannot sign.
files::Json sign(const std::string& statement, const std::string& private_key);

/// @throws files::InputError if the file holds no public key in PEM.
void require_public_key(const std::string& public_key);

/// Returns why `envelope` is not `statement` with a valid signature by `public_key` (PEM file); empty if it is. Every
/// byte of the envelope is determined by the statement, the key and the signature.
/// @throws files::InputError if the key cannot be read.
std::string why_not_signed(const files::Json& envelope, const std::string& statement,
                           const std::string& public_key);

}  // namespace swarmcert::gate
