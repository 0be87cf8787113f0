/// Where in a package of 3MF its model is: the relationships of the Open Packaging Conventions (ECMA-376, part 2).
#pragma once

#include <string>
#include <string_view>

#include "common/base/Bytes.h"

namespace tessera {

/// Where the model part is, as a package's `_rels/.rels` says it; empty: it says nothing of one, or is no XML.
[[nodiscard]] std::string startPartOf(ByteSpan relations);
/// A part's name as an archive has it, without a slash in front: with "%20" as it stands, or, decoded, a blank. Empty:
/// it is none, or leads out of the package.
[[nodiscard]] std::string partNameOf(std::string_view path, bool isDecoded);

}  // namespace tessera
