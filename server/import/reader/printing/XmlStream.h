/// XML from anybody, as it comes: elements begin and end, nothing is kept. By expat. Elements are known by their names
/// without prefixes: in 3MF and AMF no two of one place differ by their namespaces alone.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// The attributes of an element; their text is good while it begins.
class XmlAttributes {
public:
    struct Attribute {
        std::string_view name;  ///< with its prefix
        std::string_view value;
    };
    explicit XmlAttributes(const char* const* pairs) : pairs_(pairs) {}

    /// Calls with each.
    template <typename Take>
    void each(Take&& take) const {
        for (const char* const* at = pairs_; *at != nullptr; at += 2) take(Attribute{at[0], at[1]});
    }
    /// Empty: there is none of this name, or it says nothing.
    [[nodiscard]] std::string_view operator[](std::string_view name) const {
        for (const char* const* at = pairs_; *at != nullptr; at += 2)
            if (name == at[0]) return at[1];
        return {};
    }

private:
    const char* const* pairs_;  ///< name, value, …, null
};

/// What somebody makes of an XML file.
class XmlReader {
public:
    XmlReader() = default;
    XmlReader(const XmlReader&) = delete;
    XmlReader& operator=(const XmlReader&) = delete;
    virtual ~XmlReader() = default;

    /// `name`: without its prefix.
    virtual void begin(std::string_view name, const XmlAttributes& attributes) = 0;
    virtual void end() = 0;
    /// A piece of what stands between.
    virtual void text(std::string_view letters) = 0;
};

class XmlStream {
public:
    explicit XmlStream(XmlReader& reader);
    ~XmlStream();
    XmlStream(const XmlStream&) = delete;
    XmlStream& operator=(const XmlStream&) = delete;

    /// False: it is refused, and goes no further.
    bool feed(ByteSpan piece);
    /// After the last piece. kBadInput, kLimit: "line 12: …" — no XML, or one that is cut off; entities of its own
    /// (which multiply, or name other files), a tag of more than 4 MiB, elements deeper than 100 levels.
    [[nodiscard]] Expected<void> finish();

    /// What the reader found wrong stops it; finish() says it, with its line.
    void refuse(Error error);
    /// The namespace that a prefix stands for here; empty: it stands for none.
    [[nodiscard]] std::string_view namespaceOf(std::string_view prefix) const;

private:
    struct Parser;
    struct Declared {
        std::string prefix, uri;
        std::size_t depth;
    };
    void begin(const char* name, const char** attributes);
    void end();
    [[nodiscard]] std::size_t line() const;

    XmlReader& reader_;
    std::unique_ptr<Parser> parser_;
    std::vector<Declared> declared_;
    std::size_t depth_ = 0, fed_ = 0;
    Error error_;
    bool refused_ = false;
};

}  // namespace tessera
