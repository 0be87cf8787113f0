/// The keys of a wall that is started here: the server's, and those that hosts elsewhere are brought.
#pragma once

#include <memory>
#include <string>

#include "common/tls/KeyFolder.h"

namespace tessera {

class WallKeys {
public:
    /// Those of a folder, in which each host that is started elsewhere has one. Errors: the server's cannot be read.
    [[nodiscard]] static Expected<WallKeys> in(const std::string& folder);
    /// Fresh ones that are gone with this: of an authority that nobody else has. kFailed: there is no place for them.
    [[nodiscard]] static Expected<WallKeys> forThisRun(const std::string& wall);

    /// For the server's --keys.
    [[nodiscard]] const std::string& folder() const { return folder_.path(); }
    /// What that host's client reads from its input (`--keys -`). kNotFound: it has no key.
    [[nodiscard]] Expected<std::string> bundleOf(const std::string& host) const;

private:
    struct OwnFolder;
    explicit WallKeys(KeyFolder folder) : folder_(std::move(folder)) {}

    KeyFolder folder_;
    std::shared_ptr<const OwnFolder> own_;
    std::shared_ptr<const Authority> authority_;  ///< of this run; null: the folder's keys
};

}  // namespace tessera
