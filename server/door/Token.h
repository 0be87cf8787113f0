/// The word that lets a person's programs in.
#pragma once

#include <string>
#include <string_view>

namespace tessera {

/// 256 bits of the kernel's randomness, as 43 letters that may stand in a link.
[[nodiscard]] std::string freshToken();
/// Takes as long whatever differs.
[[nodiscard]] bool sameToken(std::string_view a, std::string_view b);

}  // namespace tessera
