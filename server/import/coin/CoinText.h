/// The bytes of a file of VRML, X3D or Inventor, made ready for Coin: unpacked, looked at, X3D put into VRML 2.0.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "server/import/coin/VrmlScan.h"

namespace tessera {

struct CoinText {
    std::string text;                ///< with a header that Coin knows; Inventor's binary form as it was
    std::vector<std::string> notes;  ///< what was left out on the way
};

/// `packed`: a file's bytes, maybe in gzip. kBadInput, kLimit: what is wrong with it, with the line where that is
/// known. No more than `maxBytes` come of it.
/// `missing`: see VrmlScan.h.
[[nodiscard]] Expected<CoinText> coinTextOf(ByteSpan packed, std::size_t maxBytes, const MissingProto& missing);

/// X3D, as XML or in the classic encoding, as VRML 2.0. XML's entities are refused.
[[nodiscard]] Expected<CoinText> vrmlOfX3dXml(std::string text);
[[nodiscard]] Expected<CoinText> vrmlOfX3dClassic(std::string_view text);

/// How deep brackets may be nested: Coin reads them by recursion.
inline constexpr std::size_t kMostBrackets = 1000;

}  // namespace tessera
