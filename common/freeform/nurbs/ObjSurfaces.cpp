#include "common/freeform/nurbs/ObjSurfaces.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "common/freeform/nurbs/ObjBasis.h"

namespace tessera {
namespace {

/// A statement: words, of one line or of several that end in a backslash.
struct ObjStatement {
    std::size_t line = 0;
    std::vector<std::string_view> words;
};

class ObjStatements {
public:
    explicit ObjStatements(std::string_view text) : text_(text) {}

    /// The next one that has words; none at the end.
    const ObjStatement* next() {
        statement_.words.clear();
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (c == '\n') {
                ++at_;
                ++line_;
                if (!statement_.words.empty()) return &statement_;
            } else if (c == '#') {
                at_ = std::min(text_.find('\n', at_), text_.size());
            } else if (const std::size_t continued = continuation(); continued > 0) {
                at_ += continued;
                ++line_;
            } else if (c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f') {
                ++at_;
            } else {
                if (statement_.words.empty()) statement_.line = line_;
                const std::size_t begin = at_;
                while (at_ < text_.size() &&
                       std::string_view(" \t\r\v\f\n#").find(text_[at_]) == std::string_view::npos &&
                       continuation() == 0)
                    ++at_;
                statement_.words.push_back(text_.substr(begin, at_ - begin));
            }
        }
        return statement_.words.empty() ? nullptr : &statement_;
    }

private:
    /// How long a backslash with its line's end is; 0: there is none here.
    [[nodiscard]] std::size_t continuation() const {
        if (text_.substr(at_, 2) == "\\\n") return 2;
        return text_.substr(at_, 3) == "\\\r\n" ? 3 : 0;
    }

    std::string_view text_;
    std::size_t at_ = 0, line_ = 1;
    ObjStatement statement_;
};

std::optional<double> numberOf(std::string_view word) {
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    double x = 0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), x);
    if (read.ec != std::errc() || read.ptr != word.data() + word.size() || !std::isfinite(x)) return std::nullopt;
    return x;
}
std::optional<long> integerOf(std::string_view word) {
    long x = 0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), x);
    if (read.ec != std::errc() || read.ptr != word.data() + word.size()) return std::nullopt;
    return x;
}
/// What a person may see of bytes that may be anything.
std::string quoted(std::string_view word) {
    std::string text = "'";
    for (const char c : word.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '?';
    return text + (word.size() > 40 ? "…'" : "'");
}

/// Within six digits of an end of what the knots define, it is that end.
double snapped(double x, const ParameterRange& domain) {
    const double near = 1e-5 * std::max(std::abs(domain.lower), std::abs(domain.upper));
    if (x < domain.lower && x >= domain.lower - near) return domain.lower;
    return x > domain.upper && x <= domain.upper + near ? domain.upper : x;
}

class ObjSurfaceReader {
public:
    ObjSurfaceReader(std::string_view text, std::string_view fileName, const ObjSurfaceLimits& limits)
        : statements_(text), fileName_(fileName), limits_(limits) {}

    Expected<std::vector<NurbsSurface>> read() {
        while (const ObjStatement* statement = statements_.next()) {
            const Expected<void> done =
                take(statement->words.front(), std::span(statement->words).subspan(1), statement->line);
            if (!done) return fail(done.error().code, at(errorLine_.value_or(statement->line)) + done.error().message);
        }
        if (body_.kind != Body::kNone) return fail(ErrorCode::kBadInput, at(body_.line) + body_.name() + " has no end");
        if (surfaces_.empty())
            return fail(ErrorCode::kBadInput, std::string(fileName_) + ": there is no free-form surface (surf) in it");
        return std::move(surfaces_);
    }

private:
    using Words = std::span<const std::string_view>;

    struct UsedCurve {
        double begin, end;
        std::size_t curve;
    };
    struct UsedLoop {
        LoopRole role;
        std::vector<UsedCurve> curves;
    };
    /// From an element to its end.
    struct Body {
        enum Kind { kNone, kCurve, kTrimCurve, kSurface } kind = kNone;
        std::size_t line = 0;
        bool rational = false;
        std::array<ObjAxis, 2> axes;
        std::array<double, 4> range{};
        std::vector<std::size_t> points;
        std::vector<UsedLoop> loops;

        [[nodiscard]] std::string name() const {
            return kind == kCurve ? "curv" : kind == kTrimCurve ? "curv2" : "surf";
        }
    };

    [[nodiscard]] std::string at(std::size_t line) const {
        return std::string(fileName_) + ":" + std::to_string(line) + ": ";
    }
    [[nodiscard]] static tl::unexpected<Error> wrong(std::string what) {
        return fail(ErrorCode::kBadInput, std::move(what));
    }

    Expected<void> take(std::string_view key, Words words, std::size_t line) {
        if (key == "v") return vertex(words);
        if (key == "vp") return parameterVertex(words);
        if (key == "vt" || key == "vn") return {};
        if (key == "bzp" || key == "bsp" || key == "cdc" || key == "cdp" || key == "res")
            return wrong(quoted(key) + " is a statement of version 2.11, which is not read");
        if (key == "call" || key == "csh")
            return wrong(quoted(key) + " would read another file or run a command: refused");
        if (body_.kind != Body::kNone) return takeInBody(key, words);
        if (key == "cstype") return type(words);
        if (key == "deg") return pair(words, degrees_, key);
        if (key == "step") return pair(words, steps_, key);
        if (key == "bmat") return matrix(words);
        if (key == "surf") return element(Body::kSurface, words, line);
        if (key == "curv2") return element(Body::kTrimCurve, words, line);
        if (key == "curv") return element(Body::kCurve, words, line);
        if (key == "parm" || key == "trim" || key == "hole" || key == "scrv" || key == "sp" || key == "end")
            return wrong(quoted(key) + " stands outside of a curve or surface");
        return {};
    }

    Expected<void> takeInBody(std::string_view key, Words words) {
        if (key == "end") return finish();
        if (key == "parm") return parameters(words);
        if (key == "trim" || key == "hole" || key == "scrv") return loop(key, words);
        if (key == "sp") return {};
        return wrong(quoted(key) + " is no statement of a " + body_.name() + ", and the one of line " +
                     std::to_string(body_.line) + " has no end yet");
    }

    Expected<std::vector<double>> numbers(Words words) const {
        std::vector<double> read;
        read.reserve(words.size());
        for (const std::string_view word : words) {
            const std::optional<double> x = numberOf(word);
            if (!x) return wrong(quoted(word) + " is not a finite number");
            read.push_back(*x);
        }
        return read;
    }

    Expected<void> vertex(Words words) {
        const Expected<std::vector<double>> x = numbers(words);
        if (!x) return tl::unexpected(x.error());
        if (x->size() < 3) return wrong("v needs 3 numbers or more");
        // Six numbers are a place and a colour.
        vertices_.emplace_back((*x)[0], (*x)[1], (*x)[2], x->size() == 4 ? (*x)[3] : 1.0);
        return {};
    }
    Expected<void> parameterVertex(Words words) {
        const Expected<std::vector<double>> x = numbers(words);
        if (!x) return tl::unexpected(x.error());
        if (x->empty() || x->size() > 3) return wrong("vp needs 1 to 3 numbers");
        parameterVertices_.emplace_back((*x)[0], x->size() > 1 ? (*x)[1] : 0.0, x->size() > 2 ? (*x)[2] : 1.0);
        return {};
    }

    Expected<void> type(Words words) {
        rational_ = !words.empty() && words[0] == "rat";
        if (rational_) words = words.subspan(1);
        if (words.size() != 1)
            return wrong(
                "cstype needs one type: bspline, bezier, bmatrix or cardinal, with 'rat' before it or without");
        if (words[0] == "bspline")
            type_ = ObjType::kBspline;
        else if (words[0] == "bezier")
            type_ = ObjType::kBezier;
        else if (words[0] == "bmatrix")
            type_ = ObjType::kBmatrix;
        else if (words[0] == "cardinal")
            type_ = ObjType::kCardinal;
        else if (words[0] == "taylor")
            return wrong("cstype taylor is not read: convert it to bezier");
        else
            return wrong("cstype " + quoted(words[0]) + " is not known");
        return {};
    }
    static Expected<void> pair(Words words, std::array<int, 2>& values, std::string_view key) {
        if (words.empty() || words.size() > 2) return wrong(std::string(key) + " needs 1 or 2 numbers");
        for (std::size_t k = 0; k < 2; ++k) {
            const std::optional<long> x = k < words.size() ? integerOf(words[k]) : 0;
            if (!x || *x < 0 || *x > 1'000'000) return wrong(quoted(words[k]) + " is no " + std::string(key));
            values[k] = static_cast<int>(*x);
        }
        return {};
    }
    /// Whether it is v: words begin with u or v.
    static Expected<std::size_t> axisOf(Words words, std::string_view key) {
        if (words.empty() || (words[0] != "u" && words[0] != "v"))
            return wrong(std::string(key) + " needs u or v first");
        return words[0] == "v" ? 1 : 0;
    }
    Expected<void> matrix(Words words) {
        const Expected<std::size_t> axis = axisOf(words, "bmat");
        if (!axis) return tl::unexpected(axis.error());
        Expected<std::vector<double>> x = numbers(words.subspan(1));
        if (!x) return tl::unexpected(x.error());
        matrices_[*axis] = std::move(*x);
        return {};
    }

    /// From 1, or backwards from −1; of a vertex what stands before a slash.
    static Expected<std::size_t> index(std::string_view word, std::size_t count, std::string_view what) {
        const std::optional<long> x = integerOf(word.substr(0, word.find('/')));
        if (!x) return wrong(quoted(word) + " is not the number of a " + std::string(what));
        const auto many = static_cast<long>(count);
        if (*x == 0 || *x > many || *x < -many)
            return wrong("there is no " + std::string(what) + " " + std::to_string(*x) + ": so far there are " +
                         std::to_string(count));
        return static_cast<std::size_t>(*x > 0 ? *x - 1 : many + *x);
    }

    Expected<void> element(Body::Kind kind, Words words, std::size_t line) {
        Body body{
            .kind = kind, .line = line, .rational = rational_, .axes = {}, .range = {}, .points = {}, .loops = {}};
        const std::size_t ranges = kind == Body::kSurface ? 4 : kind == Body::kCurve ? 2 : 0;
        if (words.size() < ranges + 2)
            return wrong(body.name() + " needs " + (ranges > 0 ? std::to_string(ranges) + " parameters and " : "") +
                         "2 control points or more");
        const Expected<std::vector<double>> range = numbers(words.first(ranges));
        if (!range) return tl::unexpected(range.error());
        std::copy(range->begin(), range->end(), body.range.begin());
        if (kind != Body::kCurve) {
            if (!type_) return wrong(body.name() + " comes before any cstype");
            for (std::size_t k = 0; k < 2; ++k) {
                body.axes[k] = {
                    .type = *type_, .degree = degrees_[k], .step = steps_[k], .matrix = {}, .parameters = {}};
                if (*type_ == ObjType::kBmatrix) body.axes[k].matrix = matrices_[k];
            }
            for (const std::string_view word : words.subspan(ranges)) {
                const Expected<std::size_t> point = kind == Body::kSurface
                                                        ? index(word, vertices_.size(), "vertex")
                                                        : index(word, parameterVertices_.size(), "vp");
                if (!point) return tl::unexpected(point.error());
                body.points.push_back(*point);
            }
        }
        body_ = std::move(body);
        return {};
    }

    Expected<void> parameters(Words words) {
        const Expected<std::size_t> axis = axisOf(words, "parm");
        if (!axis) return tl::unexpected(axis.error());
        std::vector<double>& known = body_.axes[*axis].parameters;
        if (!known.empty()) return wrong("parm " + std::string(words[0]) + " is given twice");
        Expected<std::vector<double>> x = numbers(words.subspan(1));
        if (!x) return tl::unexpected(x.error());
        known = std::move(*x);
        return {};
    }
    Expected<void> loop(std::string_view key, Words words) {
        if (body_.kind != Body::kSurface)
            return wrong(std::string(key) + " belongs to a surf, not to a " + body_.name());
        if (words.empty() || words.size() % 3 != 0)
            return wrong(std::string(key) + " needs two parameters and a curve, and again");
        UsedLoop used{key == "hole" ? LoopRole::kHole : LoopRole::kOuter, {}};
        for (std::size_t k = 0; k < words.size(); k += 3) {
            const Expected<std::vector<double>> range = numbers(words.subspan(k, 2));
            if (!range) return tl::unexpected(range.error());
            const Expected<std::size_t> curve = index(words[k + 2], curves_.size(), "curv2");
            if (!curve) return tl::unexpected(curve.error());
            used.curves.push_back({(*range)[0], (*range)[1], *curve});
        }
        if (key != "scrv") body_.loops.push_back(std::move(used));
        return {};
    }

    /// Counts what is about to be made.
    Expected<void> reserve(std::size_t points) {
        if (points > limits_.maxPoints - made_)
            return fail(ErrorCode::kLimit, "more than " + std::to_string(limits_.maxPoints) + " control points");
        made_ += points;
        return {};
    }

    Expected<void> finish() {
        Body body = std::exchange(body_, {});
        // Whatever is wrong now is wrong with the element.
        errorLine_ = body.line;
        Expected<void> done;
        if (body.kind == Body::kSurface) done = finishSurface(body);
        if (body.kind == Body::kTrimCurve) done = finishTrimCurve(body);
        if (!done) return failWith(body.name(), done.error());
        errorLine_.reset();
        return {};
    }

    Expected<void> finishTrimCurve(Body& body) {
        const Expected<ObjBasis> basis = ObjBasis::make(body.axes[0], "u");
        if (!basis) return tl::unexpected(basis.error());
        if (body.points.size() != basis->fileCount())
            return wrong("there are " + std::to_string(body.points.size()) + " control points, not the " +
                         std::to_string(basis->fileCount()) + " that degree and parm ask for");
        if (Expected<void> room = reserve(static_cast<std::size_t>(basis->knots().count())); !room) return room;
        std::vector<Vec3d> file;
        for (const std::size_t k : body.points) {
            const Vec3d& p = parameterVertices_[k];
            const double w = body.rational ? p.z() : 1;
            file.emplace_back(w * p.x(), w * p.y(), w);
        }
        TrimCurve curve{.knots = basis->knots(), .points = basis->points(file.data(), 1), .begin = 0, .end = 0};
        if (Expected<void> sound = checkKnots(curve.knots, curve.points.size(), "u"); !sound) return sound;
        curves_.push_back(std::move(curve));
        return {};
    }

    Expected<void> finishSurface(Body& body) {
        const Expected<ObjBasis> u = ObjBasis::make(body.axes[0], "u"), v = ObjBasis::make(body.axes[1], "v");
        if (!u) return tl::unexpected(u.error());
        if (!v) return tl::unexpected(v.error());
        if (body.points.size() % u->fileCount() != 0 || body.points.size() / u->fileCount() != v->fileCount())
            return wrong("there are " + std::to_string(body.points.size()) + " control points, not the " +
                         std::to_string(u->fileCount()) + " by " + std::to_string(v->fileCount()) +
                         " that degrees and parms ask for");
        const auto countU = static_cast<std::size_t>(u->knots().count()),
                   countV = static_cast<std::size_t>(v->knots().count());
        if (countU > limits_.maxPoints) return reserve(countU);
        if (Expected<void> room = reserve(countU * std::max(countV, v->fileCount())); !room) return room;
        std::vector<Vec4d> file;
        for (const std::size_t k : body.points) {
            const Vec4d& p = vertices_[k];
            const double w = body.rational ? p.w() : 1;
            file.emplace_back(w * p.x(), w * p.y(), w * p.z(), w);
        }
        std::vector<Vec4d> rows;  // along u as they will be, along v as in the file
        for (std::size_t j = 0; j < v->fileCount(); ++j) {
            const std::vector<Vec4d> row = u->points(file.data() + j * u->fileCount(), 1);
            rows.insert(rows.end(), row.begin(), row.end());
        }
        NurbsDefinition d{.u = u->knots(),
                          .v = v->knots(),
                          .points = std::vector<Vec4d>(countU * countV),
                          .rangeU = {},
                          .rangeV = {},
                          .loops = {}};
        for (std::size_t i = 0; i < countU; ++i) {
            const std::vector<Vec4d> column = v->points(rows.data() + i, countU);
            for (std::size_t j = 0; j < countV; ++j) d.points[j * countU + i] = column[j];
        }
        if (Expected<void> sound = checkKnots(d.u, countU, "u"); !sound) return sound;
        if (Expected<void> sound = checkKnots(d.v, countV, "v"); !sound) return sound;
        const ParameterRange domainU = d.u.domain(), domainV = d.v.domain();
        d.rangeU = {snapped(body.range[0], domainU), snapped(body.range[1], domainU)};
        d.rangeV = {snapped(body.range[2], domainV), snapped(body.range[3], domainV)};
        for (const UsedLoop& used : body.loops) {
            TrimLoop& made = d.loops.emplace_back(TrimLoop{.role = used.role, .curves = {}});
            for (const UsedCurve& part : used.curves) {
                const TrimCurve& curve = curves_[part.curve];
                // As many as its Bézier curves have: that is how a region keeps it.
                if (Expected<void> room =
                        reserve(curve.points.size() * (static_cast<std::size_t>(curve.knots.degree) + 1));
                    !room)
                    return room;
                TrimCurve& piece = made.curves.emplace_back(curve);
                piece.begin = snapped(part.begin, curve.knots.domain());
                piece.end = snapped(part.end, curve.knots.domain());
            }
        }
        Expected<NurbsSurface> surface = NurbsSurface::make(std::move(d));
        if (!surface) return tl::unexpected(surface.error());
        surfaces_.push_back(std::move(*surface));
        return {};
    }

    ObjStatements statements_;
    std::string_view fileName_;
    ObjSurfaceLimits limits_;
    std::vector<Vec4d> vertices_;           // x, y, z, weight
    std::vector<Vec3d> parameterVertices_;  // u, v, weight
    bool rational_ = false;
    std::optional<ObjType> type_;
    std::array<int, 2> degrees_{}, steps_{};
    std::array<std::vector<double>, 2> matrices_;
    Body body_;
    std::optional<std::size_t> errorLine_;
    std::vector<TrimCurve> curves_;
    std::vector<NurbsSurface> surfaces_;
    std::size_t made_ = 0;
};

}  // namespace

Expected<std::vector<NurbsSurface>> readNurbsObj(std::string_view text, std::string_view fileName,
                                                 const ObjSurfaceLimits& limits) {
    return ObjSurfaceReader(text, fileName, limits).read();
}

}  // namespace tessera
