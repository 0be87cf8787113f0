#include "tests/integration/SshServer.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <pwd.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

#include "tests/unit/Eventually.h"

namespace tessera::test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

struct SshdProgram {
    std::string program, libraries;  ///< libraries: empty: the system's
};
/// The system's, or what `deploy/set-up` has unpacked.
SshdProgram findSshd() {
    if (fs::exists("/usr/sbin/sshd")) return {"/usr/sbin/sshd", ""};
    SshdProgram found;
    std::error_code ignored;
    std::string build = std::string(TESSERA_BIN_DIR) + "/..";
    if (!fs::exists(build + "/sshd")) build = TESSERA_SOURCE_DIR "/build";  // of a build with another compiler
    if (fs::exists(build + "/sshd/usr/sbin/sshd"))
        found.program = fs::canonical(build + "/sshd/usr/sbin/sshd").string();
    for (const auto& entry : fs::recursive_directory_iterator(build + "/sshd-libraries", ignored))
        if (entry.path().filename() == "libwrap.so.0")
            found.libraries = fs::canonical(entry.path().parent_path()).string();
    return found;
}

int callOk(const std::string& command) {
    return std::system((command + " >/dev/null 2>&1").c_str());
}

bool answers(const std::string& address, int port) {
    const int handle = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, address.c_str(), &to.sin_addr);
    const bool there = ::connect(handle, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    ::close(handle);
    return there;
}

/// All processes below this one.
std::vector<pid_t> descendantsOf(pid_t top) {
    std::vector<pid_t> found{top};
    for (std::size_t i = 0; i < found.size(); ++i) {
        std::istringstream children(readText(fmt::format("/proc/{0}/task/{0}/children", found[i])));
        for (pid_t child = 0; children >> child;) found.push_back(child);
    }
    found.erase(found.begin());
    return found;
}

}  // namespace

int closedPort() {
    const int handle = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{.sin_family = AF_INET, .sin_port = 0, .sin_addr = {htonl(INADDR_LOOPBACK)}, .sin_zero = {}};
    socklen_t size = sizeof at;
    if (::bind(handle, reinterpret_cast<const sockaddr*>(&at), size) != 0) return 0;
    ::getsockname(handle, reinterpret_cast<sockaddr*>(&at), &size);
    ::close(handle);
    return ntohs(at.sin_port);
}

std::string SshServer::whyNot() {
    if (callOk("command -v ssh") != 0 || callOk("command -v ssh-keygen") != 0)
        return "ssh is not installed (openssh-client)";
    if (::getpwuid(::geteuid()) == nullptr) return "this user has no account here (/etc/passwd), and ssh wants one";
    if (findSshd().program.empty()) return "there is no sshd (deploy/set-up unpacks one into the build folder)";
    if (::geteuid() == 0 && callOk("unshare -m true") != 0)
        return "sshd wants an account of its own as root, and there is no way to give it one here (unshare -m)";
    return "";
}

SshServer::SshServer(const std::string& folder, SshPlace place) : place_(std::move(place)), folder_(folder + "/ssh") {
    const drill::NetworkNamespace::Inside inside(place_.network);
    port_ = closedPort();
    fs::create_directories(folder_);
    const std::string own = fmt::format("{}/{}-{}", folder_, place_.address, port_);  // how its own files begin
    const auto write = [&](const std::string& name, const std::string& text, bool runs = false) {
        const std::string path = name.starts_with('/') ? name : folder_ + "/" + name;
        if (FILE* file = std::fopen(path.c_str(), "w")) {
            std::fwrite(text.data(), 1, text.size(), file);
            std::fclose(file);
        }
        fs::permissions(path, runs ? fs::perms::owner_all : fs::perms::owner_read | fs::perms::owner_write);
        return path;
    };
    for (const char* key : {"host", "mine", "other"})
        if (!fs::exists(fmt::format("{}/{}", folder_, key)))
            callOk(fmt::format("ssh-keygen -q -t ed25519 -N '' -C {1} -f '{0}/{1}'", folder_, key));
    write("authorized_keys", readText(folder_ + "/mine.pub"));
    write("known_hosts", fmt::format("{}[{}]:{} {}", readText(folder_ + "/known_hosts"), place_.address, port_,
                                     readText(folder_ + "/host.pub")));
    const char* run = std::getenv("XDG_RUNTIME_DIR");
    write(own + ".config",
          fmt::format("ListenAddress {3}\nPort {0}\nHostKey {1}/host\nAuthorizedKeysFile "
                      "{1}/authorized_keys\nPidFile none\nStrictModes no\n"
                      "UsePAM no\nPasswordAuthentication no\nKbdInteractiveAuthentication no\nPermitRootLogin "
                      "prohibit-password\nMaxStartups 100\n"
                      "PermitUserEnvironment no\nLogLevel VERBOSE\n{2}",
                      // As pam_systemd gives sessions theirs: programs of one user find each other.
                      port_, folder_, run != nullptr ? fmt::format("SetEnv XDG_RUNTIME_DIR={}\n", run) : "",
                      place_.address));
    const auto client = [&](const std::string& name, const std::string& key, const std::string& known) {
        return write(
            name,
            fmt::format(
                "#!/bin/sh\nexec ssh -F /dev/null -i '{0}/{1}' -o IdentitiesOnly=yes -o UserKnownHostsFile='{0}/{2}' "
                "-o GlobalKnownHostsFile=/dev/null -o StrictHostKeyChecking=yes \"$@\"\n",
                folder_, key, known),
            true);
    };
    client_ = client("ssh-mine", "mine", "known_hosts");
    stranger_ = client("ssh-stranger", "other", "known_hosts");
    newcomer_ = client("ssh-newcomer", "mine", "none");
    const SshdProgram sshd = findSshd();
    const std::string start = fmt::format(
        "{}exec '{}' -D -e -f '{}.config'",
        sshd.libraries.empty() ? "" : fmt::format("export LD_LIBRARY_PATH='{}'; ", sshd.libraries), sshd.program, own);
    std::vector<std::string> command = {"/bin/sh", "-c", start};
    if (::geteuid() == 0) {
        const std::string view = fmt::format(
            "{{ cat /etc/passwd; echo; }} > '{0}.passwd'; grep -q ^sshd: /etc/passwd || "
            "echo 'sshd:x:64022:65534::/run/sshd:/usr/sbin/nologin' >>'{0}.passwd'; "
            "mount --bind '{0}.passwd' /etc/passwd && mount -t tmpfs none /run && mkdir -m 755 /run/sshd && ",
            own);
        command = {"/usr/bin/unshare", "-m", "/bin/sh", "-c", view + start};
    }
    server_ = std::make_unique<Process>(folder_, "sshd", command);
    bool there = false;
    (void)eventually([&] { return !server_->running() || (there = answers(place_.address, port_)); });
    if (!there) port_ = 0;
}

void SshServer::cutAll() {
    // sshd's own processes alone: what they have started is to find out by itself.
    for (const pid_t pid : descendantsOf(server_->pid()))
        if (readText(fmt::format("/proc/{}/comm", pid)) == "sshd\n") ::kill(pid, SIGKILL);
}

}  // namespace tessera::test
