/// What our own code makes of VRML, X3D and Inventor before Coin sees it. (The rest is Coin's, which is why there is a
/// child.)
#include <string>

#include "server/import/coin/CoinReader.h"
#include "server/import/coin/CoinText.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

void run(FuzzInput in) {
    static const bool kReady = (prepareCoin(), true);
    must(kReady, "Coin starts");
    constexpr const char* kHeaders[] = {"#VRML V2.0 utf8\n", "#VRML V1.0 ascii\n", "#Inventor V2.1 ascii\n",
                                        "#X3D V3.2 utf8\n",  "<X3D><Scene>",       ""};
    const std::string header = kHeaders[in.below(6)];
    const std::string text = header + std::string(asText(in.rest()));
    constexpr std::size_t kMost = 1 << 20;
    const MissingProto missing = [](const std::vector<std::string>& urls) {
        return std::string(urls.size() % 2 == 0 ? "there is none" : "");
    };
    const Expected<CoinText> made = coinTextOf(asBytes(text), kMost, missing);
    if (!made) return must(!made.error().message.empty(), "a refusal has words");
    must(made->text.starts_with('#'), "what Coin reads has a header");
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
