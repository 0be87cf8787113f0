/// Which vector instructions does this processor have? One binary carries kernels for each.
#pragma once

#include <cstdint>
#include <string_view>

namespace tessera {

enum class InstructionSet : std::uint8_t { kSse41, kAvx2, kAvx512 };

/// The best one here, asked once. The environment variable TESSERA_ISA (sse41, avx2, avx512) lowers it, for tests and
/// comparisons; what the processor lacks, or another word, is ignored. Answers of queries never depend on it.
[[nodiscard]] InstructionSet instructionSet();

[[nodiscard]] std::string_view name(InstructionSet set);

}  // namespace tessera
