/// @file Tables of the logarithm and the exponential in vector_functions.inc.
#pragma once

namespace swarmcert::stability::function_tables {

/// Sixteen intervals of [0.6875, 1.375), selected by the four highest significand bits of a number after subtracting
/// the bits of 0.6875. kInverse holds 1 / c with c close to the middle of the interval, so that |m / c - 1| < 0.0304 in
/// it. Among the candidates near the middle, c is chosen such that ln c rounded to 42 fractional bits has an error
/// below 2e-18; sums of that value with integer multiples of kLogOfTwo are then exact.
alignas(64) inline constexpr double kInverse[16] = {
    0x1.6c16c16c1b276p+0, 0x1.5c9882b92464bp+0, 0x1.4e5e0a72f1de2p+0, 0x1.4141414140a47p+0,
    0x1.3521cfb2b1c6ap+0, 0x1.29e4129e3fda9p+0, 0x1.1f7047dc1b32fp+0, 0x1.15b1e5f75b1fdp+0,
    0x1.0c9714fbd8d02p+0, 0x1.041041041da07p+0, 0x1.f07c1f07bd3p-1,   0x1.d41d41d4179fap-1,
    0x1.bacf914c20492p-1, 0x1.a41a41a423fbcp-1, 0x1.8f9c18f9bc134p-1, 0x1.7d05f417c6a1ep-1};
/// ln c.
alignas(64) inline constexpr double kLog[16] = {
    -0x1.68ac83e9d3p-2, -0x1.3c2527730ep-2, -0x1.1178e82283p-2, -0x1.d1037f2652p-3,
    -0x1.823c1654f4p-3, -0x1.365fcb015p-3,  -0x1.da727638c8p-4, -0x1.4d3115d288p-4,
    -0x1.894aa14b5p-5,  -0x1.0205658c8p-6,  0x1.f829b0e82p-6,   0x1.6f0d28ae88p-4,
    0x1.29552f81eap-3,  0x1.9525a9cf16p-3,  0x1.fb9186d6p-3,    0x1.2e8e2bae2cp-2};
/// ln 2 to 42 fractional bits, and the remainder.
inline constexpr double kLogOfTwo = 0x1.62e42fefa38p-1, kRestOfLogOfTwo = 0x1.ef35793c7673p-45;

/// 2^(j/16), rounded; error at most 8.2e-17.
alignas(64) inline constexpr double kPowerOfTwo[16] = {0x1p+0,
                                                       0x1.0b5586cf9890fp+0,
                                                       0x1.172b83c7d517bp+0,
                                                       0x1.2387a6e756238p+0,
                                                       0x1.306fe0a31b715p+0,
                                                       0x1.3dea64c123422p+0,
                                                       0x1.4bfdad5362a27p+0,
                                                       0x1.5ab07dd485429p+0,
                                                       0x1.6a09e667f3bcdp+0,
                                                       0x1.7a11473eb0187p+0,
                                                       0x1.8ace5422aa0dbp+0,
                                                       0x1.9c49182a3f09p+0,
                                                       0x1.ae89f995ad3adp+0,
                                                       0x1.c199bdd85529cp+0,
                                                       0x1.d5818dcfba487p+0,
                                                       0x1.ea4afa2a490dap+0};
/// ln 2 / 16, rounded, and the remainder; 16 / ln 2.
inline constexpr double kStep = 0x1.62e42fefa39efp-5, kRestOfStep = 0x1.abc9e3b39803fp-60;
inline constexpr double kStepsPerOne = 0x1.71547652b82fep+4;

}  // namespace swarmcert::stability::function_tables
