/// Zip archives from anybody: what is in them is read up to a bound, whatever they say of themselves.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

class ZipFile {
public:
    /// At most 4096 entries. kBadInput: not a zip; two entries of one name; a name that leads out of the archive ("..",
    /// "/", "\\" or a drive).
    [[nodiscard]] static Expected<ZipFile> open(const std::string& path);
    ~ZipFile();
    ZipFile(ZipFile&&) noexcept;
    ZipFile& operator=(ZipFile&&) noexcept;

    /// kNotFound: there is none of that name, capitals counted; kLimit: it is larger than `atMost`, or all that was
    /// read from this archive than 1 GiB, found while it is unpacked; kBadInput: damaged.
    [[nodiscard]] Expected<Bytes> read(const std::string& name, std::size_t atMost);
    /// The first entry with this ending, or none.
    [[nodiscard]] std::string firstWith(const std::string& ending) const;

private:
    struct Impl;
    explicit ZipFile(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
