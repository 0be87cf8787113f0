#include "server/collision/mesh/InstructionSet.h"

#include <algorithm>
#include <cstdlib>

namespace tessera {
namespace {

InstructionSet ofProcessor() {
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma"))
        return InstructionSet::kAvx512;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
        return InstructionSet::kAvx2;
    return InstructionSet::kSse41;
}

InstructionSet wished(InstructionSet best) {
    const char* const word = std::getenv("TESSERA_ISA");
    if (word == nullptr) return best;
    for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2, InstructionSet::kAvx512})
        if (name(set) == word) return std::min(set, best);
    return best;
}

}  // namespace

InstructionSet instructionSet() {
    static const InstructionSet set = wished(ofProcessor());
    return set;
}

std::string_view name(InstructionSet set) {
    switch (set) {
        case InstructionSet::kSse41:
            return "sse41";
        case InstructionSet::kAvx2:
            return "avx2";
        case InstructionSet::kAvx512:
            return "avx512";
    }
    return "";
}

}  // namespace tessera
