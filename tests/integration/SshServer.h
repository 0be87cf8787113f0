/// An sshd of the test's own, on loopback or on a machine of its own: keys, configuration, port and log lie in its
/// folder.
#pragma once

#include <memory>
#include <string>

#include "tests/drill/Network.h"
#include "tests/integration/Process.h"

namespace tessera::test {

struct SshPlace {
    std::string address = "127.0.0.1";
    const drill::NetworkNamespace* network = nullptr;  ///< whose address that is; null: the test's own
};

/// Whoever runs the test is let in, by a key. As root it needs an account "sshd" and /run/sshd: it gets both in a view
/// of the file system that is its own (unshare), so that nothing outside changes.
class SshServer {
public:
    /// Why there can be none here; empty: there can.
    [[nodiscard]] static std::string whyNot();

    /// Those of one folder share its keys: the client of the last one reaches them all.
    explicit SshServer(const std::string& folder, SshPlace place = {});
    /// It answers.
    [[nodiscard]] bool good() const { return port_ != 0; }
    [[nodiscard]] int port() const { return port_; }
    [[nodiscard]] const std::string& address() const { return place_.address; }
    /// A program that is ssh with the test's key and without anybody's configuration.
    [[nodiscard]] const std::string& client() const { return client_; }
    /// The same with a key that nobody knows; and without knowing the server.
    [[nodiscard]] const std::string& strangersClient() const { return stranger_; }
    [[nodiscard]] const std::string& newcomersClient() const { return newcomer_; }
    [[nodiscard]] std::string log() const { return server_->output(); }
    /// Kills all its connections, from the server's side, as a machine does that loses its power; it goes on answering.
    void cutAll();

private:
    SshPlace place_;
    std::string folder_, client_, stranger_, newcomer_;
    int port_ = 0;
    std::unique_ptr<Process> server_;
};

/// A port of loopback where nobody answers, at least for now.
[[nodiscard]] int closedPort();

}  // namespace tessera::test
