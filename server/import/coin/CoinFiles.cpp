#include "server/import/coin/CoinFiles.h"

#include <Inventor/SoDB.h>
#include <Inventor/SoInteraction.h>

#include <Inventor/VRMLnodes/SoVRMLImageTexture.h>
#include <Inventor/VRMLnodes/SoVRMLInline.h>
#include <Inventor/errors/SoDebugError.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/lists/SoFieldList.h>
#include <Inventor/misc/SoProto.h>
#include <Inventor/nodes/SoFile.h>
#include <Inventor/nodes/SoTexture2.h>
#include <Inventor/nodes/SoWWWInline.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "server/import/coin/CoinInput.h"
#include "server/import/coin/CoinNames.h"
#include "server/import/coin/CoinText.h"

namespace tessera {
namespace {

/// Coin would open the file by itself, wherever it is and as often as files name each other.
template <typename Kind>
class Unopened : public Kind {
public:
    static void replace() {
        SoType::overrideType(Kind::getClassTypeId(), [] { return static_cast<void*>(new Unopened); });
    }
    SbBool readInstance(SoInput* in, unsigned short flags) override {
        notify(FALSE);
        const SbBool read = this->SoNode::readInstance(in, flags);
        notify(TRUE);
        return read;
    }

private:
    /// It listens to its own fields.
    void notify(SbBool on) {
        SoFieldList fields;
        const int count = this->getFields(fields);
        for (int i = 0; i < count; ++i) fields[i]->enableNotify(on);
    }
};

/// Coin's words about what is being read: "Coin read error: What\n\tOccurred at line   3 in <memory>".
std::vector<std::string>& complaints() {
    static std::vector<std::string> all;
    return all;
}

void keepComplaint(const SoError* error, void*) {
    constexpr std::size_t kMost = 10;
    if (complaints().size() >= kMost) return;
    std::string text = error->getDebugString().getString();
    if (const std::size_t begin = text.find("error: "); begin != text.npos) text.erase(0, begin + 7);
    const std::size_t at = text.find("\n\tOccurred at line");
    std::string line;
    if (at != text.npos) {
        const std::size_t digits = text.find_first_of("0123456789", at);
        if (digits != text.npos) line = text.substr(digits, text.find_first_not_of("0123456789", digits) - digits);
        text.erase(at);
    }
    std::ranges::replace_if(
        text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
    text = text.substr(0, 200);
    complaints().push_back(line.empty() ? text : fmt::format("line {}: {}", line, text));
}

std::string folderOf(const std::string& path) {
    return path.substr(0, path.rfind('/'));
}

/// Where an EXTERNPROTO names a file alone, it means the first in it.
std::string firstProtoIn(const std::string& text) {
    for (std::size_t at = text.find("PROTO"); at != text.npos; at = text.find("PROTO", at + 1)) {
        const bool word = (at == 0 || std::isspace(static_cast<unsigned char>(text[at - 1])) != 0) &&
                          at + 5 < text.size() && std::isspace(static_cast<unsigned char>(text[at + 5])) != 0;
        if (!word) continue;
        const std::size_t begin = text.find_first_not_of(" \t\r\n", at + 5);
        if (begin == text.npos) break;
        return text.substr(begin, std::min(text.find_first_of(" \t\r\n[", begin), begin + 200) - begin);
    }
    return {};
}

bool isFetched(const std::string& url) {
    const std::size_t scheme = url.find("://");
    return scheme != url.npos && scheme < 10;
}

}  // namespace

void CoinFiles::prepare() {
    // For each kind of node that it does not know Coin would look for libraries.
    ::setenv("COIN_NO_SOTYPE_DYNLOAD", "1", 1);
    SoDB::init();
    SoInteraction::init();  // manipulators; and node kits, which these are
    // Names the file that Coin's dictionary is in: else the program would be linked without it.
    (void)coinAsksHereForNames();

    // With each value that it reads Coin asks whether it reads from the standard input, of which it keeps a copy. One
    // that it cannot have in confinement it would ask for each time.
    if (::fcntl(STDIN_FILENO, F_GETFD) < 0) (void)::open("/dev/null", O_RDONLY | O_CLOEXEC);
    constexpr std::string_view kAny = "#VRML V2.0 utf8\n";
    (void)CoinInput(kAny, __builtin_frame_address(0)).isFileVRML2();

    SoInput::clearDirectories();
    Unopened<SoFile>::replace();
    Unopened<SoVRMLInline>::replace();
    Unopened<SoWWWInline>::replace();
    Unopened<SoTexture2>::replace();
    Unopened<SoVRMLImageTexture>::replace();
    SoVRMLImageTexture::setDelayFetchURL(TRUE);
    SoReadError::setHandlerCallback(keepComplaint, nullptr);
    SoDebugError::setHandlerCallback([](const SoError*, void*) {}, nullptr);
}

CoinFiles::CoinFiles(const std::string& path, const ReadLimits& limits, PlainScene& scene)
    : folder_(folderOf(path), limits.maxFileBytes),
      maxBytes_(limits.maxFileBytes),
      scene_(scene),
      stackBegin_(__builtin_frame_address(0)) {
    SoProto::setFetchExternProtoCallback(&CoinFiles::fetchProto, this);
}

CoinFiles::~CoinFiles() {
    SoProto::setFetchExternProtoCallback(nullptr, nullptr);
    for (const auto& [path, root] : opened_)
        if (root) (*root)->unref();
}

Expected<std::string> CoinFiles::find(const std::string& name, const std::string& from) const {
    if (isFetched(name) && !name.starts_with("file://"))
        return fail(ErrorCode::kRefused, "nothing is fetched from other machines: put it into the folder");
    const std::string plain = name.starts_with("file://") ? name.substr(7) : name;
    // As seen from the file that names it, where that lies deeper.
    const std::string deeper = folderOf(from) + "/" + plain;
    if (plain.front() != '/' && folderOf(from) != folder_.folder())
        if (Expected<std::string> found = folder_.resolve(deeper)) return found;
    const Expected<FolderFiles::Found> found = folder_.find(plain);
    if (!found) return tl::unexpected(found.error());
    if (!found->note.empty()) scene_.note("a file: " + found->note);
    return found->path;
}

Expected<SoSeparator*> CoinFiles::open(const std::string& path) {
    const auto known = opened_.find(path);
    if (known != opened_.end()) return known->second;
    Expected<SoSeparator*> root = parse(path);
    if (root) (*root)->ref();
    return opened_.emplace(path, std::move(root)).first->second;
}

Expected<SoSeparator*> CoinFiles::parse(const std::string& path) {
    const Expected<Bytes> bytes = folder_.read(path);
    if (!bytes) return tl::unexpected(bytes.error());
    reading_.push_back(path);
    Expected<CoinText> text = textOf(*bytes);
    reading_.pop_back();
    if (!text) return tl::unexpected(text.error());
    for (std::string& note : text->notes) scene_.note(std::move(note));
    textBytes_ += text->text.size();
    CoinInput in(text->text, stackBegin_);
    complaints().clear();
    reading_.push_back(path);
    SoSeparator* const root = SoDB::readAll(&in);
    reading_.pop_back();
    if (!in.problem().empty()) return fail(ErrorCode::kBadInput, in.problem());
    if (root == nullptr) {
        std::string why =
            complaints().empty() ? "Coin finds nothing in it" : "it cannot be read: " + complaints().front();
        if (!problems_.empty()) why += "; " + problems_.front();
        return fail(ErrorCode::kBadInput, std::move(why));
    }
    for (const std::string& complaint : complaints()) scene_.note("Coin finds fault with it: " + complaint);
    return root;
}

Expected<CoinText> CoinFiles::textOf(ByteSpan bytes) const {
    return coinTextOf(bytes, maxBytes_, [this](const std::vector<std::string>& urls) {
        std::string first = "it names no file";
        for (std::size_t i = 0; i < urls.size(); ++i) {
            const std::string file = urls[i].substr(0, urls[i].find('#'));
            std::string why = "it names no file";
            if (const Expected<std::string> path = file.empty() ? Expected<std::string>() : find(file, reading_.back());
                !path)
                why = path.error().message;
            else if (!file.empty())
                why = std::ranges::find(reading_, *path) == reading_.end() ? "" : "files name each other in a circle";
            if (why.empty()) return why;
            if (i == 0) first = std::move(why);
        }
        return first;
    });
}

SoProto* CoinFiles::fetchProto(SoInput* in, const SbString* urls, int count, void* self) {
    CoinFiles& files = *static_cast<CoinFiles*>(self);
    for (int i = 0; i < count; ++i)
        if (SoProto* const proto = files.protoOf(urls[i].getString(), *in)) return proto;
    return nullptr;
}

/// `url`: "file.wrl#Name".
SoProto* CoinFiles::protoOf(const std::string& url, SoInput&) {
    const std::size_t hash = url.find('#');
    const std::string file = url.substr(0, hash), name = hash == url.npos ? "" : url.substr(hash + 1);
    const auto leaveOut = [&](const std::string& why) -> SoProto* {
        problems_.push_back(fmt::format("the EXTERNPROTO '{}' is not there: {}", url.substr(0, 200), why));
        return nullptr;
    };
    if (file.empty() || reading_.empty()) return leaveOut("it names no file");
    const Expected<std::string> path = find(file, reading_.back());
    if (!path) return leaveOut(path.error().message);
    if (std::ranges::find(reading_, *path) != reading_.end()) return leaveOut("files name each other in a circle");
    const Expected<Bytes> bytes = folder_.read(*path);
    if (!bytes) return leaveOut(bytes.error().message);
    reading_.push_back(*path);
    const Expected<CoinText> text = textOf(*bytes);
    if (!text) {
        reading_.pop_back();
        return leaveOut(text.error().message);
    }
    CoinInput in(text->text, stackBegin_);
    SoSeparator* const root = SoDB::readAll(&in);
    reading_.pop_back();
    if (!in.problem().empty()) return leaveOut(in.problem());
    if (root != nullptr) root->ref();  // its prototypes live as long as the process
    SoProto* const proto = SoProto::findProto(SbName((name.empty() ? firstProtoIn(text->text) : name).c_str()));
    return proto != nullptr ? proto : leaveOut("that file has no PROTO of this name");
}

}  // namespace tessera
