/// A package of USD (.usdz): a zip archive whose files stand in it as they are. Written after PKWARE's APPNOTE and the
/// published description of usdz.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

class UsdPackage {
public:
    /// kBadInput or kLimit in words: no archive, a part beyond its end, compressed or encrypted (which usdz are not,
    /// and zip bombs are), more names than bytes for them.
    [[nodiscard]] static Expected<std::shared_ptr<const UsdPackage>> open(Bytes bytes);

    /// The name of the layer that the package is: its first file.
    [[nodiscard]] const std::string& first() const { return first_; }
    /// A file in it; nothing: there is none of that name.
    [[nodiscard]] ByteSpan find(const std::string& name) const;
    [[nodiscard]] bool has(const std::string& name) const { return parts_.contains(name); }
    /// Names of files that are not as usdz has them, which are not read.
    [[nodiscard]] bool isPacked(const std::string& name) const;

private:
    struct Part {
        std::size_t begin = 0, size = 0;
        bool stored = true;
    };
    Bytes bytes_;
    std::map<std::string, Part> parts_;
    std::string first_;
};

}  // namespace tessera
