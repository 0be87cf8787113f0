/// A look at the text of VRML or Inventor before Coin reads it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// Refuses what Coin would not survive: brackets deeper than kMostBrackets, prototypes that contain themselves or stand
/// for more nodes than a scene has. Coin refuses a file for one kind of node that it does not know:
/// such nodes become empty groups, and are named in `notes`. So do those of an EXTERNPROTO that is `missing`, and uses
/// of a node inside itself. Errors name the line.
enum class Dialect {
    kInventor,  ///< and VRML 1
    kVrml2,
    kX3d  ///< the classic encoding, which is put into VRML 2: brackets alone are looked at
};
/// Why the file of a prototype, of which these are the names, cannot be had; empty: it can.
using MissingProto = std::function<std::string(const std::vector<std::string>& urls)>;

[[nodiscard]] Expected<void> scanVrml(std::string& text, Dialect dialect, const MissingProto& missing,
                                      std::vector<std::string>& notes);

}  // namespace tessera
