/// What tests of walls share whose hosts are started by ssh.
#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

#include "common/image/Picture.h"
#include "tests/integration/LiveWall.h"
#include "tests/integration/SshServer.h"

namespace tessera::test {

/// Processes of this machine that run a client of this build with `word` among their arguments.
[[nodiscard]] std::vector<pid_t> clientsWith(const std::string& word);

class StartedWall : public testing::Test {
protected:
    static std::string me();
    /// What a host's machine says in the wall file, where that sshd is; `more` behind the address. `port`: another one.
    [[nodiscard]] static std::string machineAt(const SshServer& sshd, const std::string& more = "", int port = 0);
    [[nodiscard]] static std::string client(const std::string& path = program("tessera-client"));
    /// Two tiles; the left one's host, "west", is started as `left` says, the right one's, "east", as `right`. Empty:
    /// here.
    std::string wallOf(const std::string& left, const std::string& right);
    /// tessera-wall --start with a small yard.
    std::vector<std::string> command(const SshServer& sshd, const std::string& wall,
                                     std::vector<std::string> more = {}) const;
    static Picture picture(const std::string& file);
    /// No client of this test's wall lives any more.
    static bool allGone(std::chrono::milliseconds patience);

    TemporaryFolder folder_;
};

}  // namespace tessera::test
