/// What the verbs of tessera-keys do.
#pragma once

#include <string>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

struct KeysArguments {
    std::string keys = "keys";  ///< the folder
    bool keysNamed = false;     ///< by the command line
    std::string wall;           ///< a file, or a shipped wall's name
    std::string names;          ///< of the server, with commas between; empty: this machine's
    std::vector<std::string> holders;
    std::string role;
    std::string out;   ///< the folder that new keys go to; empty: `keys`
    std::string file;  ///< of `exportAuthority`; "-": the standard output
    bool all = false;
    bool links = false;  ///< of `revokeKeys`: not somebody's keys, but all tokens and links that were handed out
    double hours = 8;    ///< of a token
    std::string panel;   ///< the file of the one that a token is of; empty: of none
};

/// Each returns what there is to print. kNotFound: the folder, or somebody's key, is not there. kRefused: there is a
/// key already; somebody else may read or has the folder.
[[nodiscard]] Expected<std::string> initKeys(const KeysArguments& arguments);
[[nodiscard]] Expected<std::string> issueHost(const KeysArguments& arguments);
[[nodiscard]] Expected<std::string> issuePerson(const KeysArguments& arguments);
[[nodiscard]] Expected<std::string> listKeys(const KeysArguments& arguments);
[[nodiscard]] Expected<std::string> revokeKeys(const KeysArguments& arguments);
[[nodiscard]] Expected<std::string> renewKeys(const KeysArguments& arguments);
[[nodiscard]] Expected<std::string> issueToken(const KeysArguments& arguments);
[[nodiscard]] Expected<std::string> exportAuthority(const KeysArguments& arguments);

}  // namespace tessera
