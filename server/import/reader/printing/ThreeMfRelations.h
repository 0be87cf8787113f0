/// Where in a package of 3MF its model is: the relationships of the Open Packaging Conventions (ECMA-376, part 2).
#pragma once

#include <string>
#include <string_view>

#include "common/base/Bytes.h"

namespace tessera {

/// The name of the model part that a package's `_rels/.rels` names; empty: it names none, or is no XML.
[[nodiscard]] std::string startPartOf(ByteSpan relations);
/// A part's name as an archive has it: no slash in front, "%20" a blank. Empty: it is none, or leads out of the
/// package.
[[nodiscard]] std::string partNameOf(std::string_view path);

}  // namespace tessera
