#include "pipeline/eval/eval.h"

#include <algorithm>
#include <cmath>
#include <istream>
#include <limits>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "formats/json_text.h"
#include "pipeline/eval/eval_quantities.h"

namespace heddle {
namespace {

struct Quantity {
  const char* name;
  nlohmann::json (*evaluate)(EvalObject&);
};

constexpr Quantity kQuantities[] = {
    {"bcsdf", eval_bcsdf},
    {"bcsdf_albedo", eval_bcsdf_albedo},
    {"bcsdf_sh", eval_bcsdf_sh},
    {"clipped_gaussians", eval_clipped_gaussians},
    {"microcylinder", eval_microcylinder},
    {"sg_mass", eval_sg_mass},
    {"sg_product", eval_sg_product},
    {"sg_scatter", eval_sg_scatter},
    {"sg_zonal", eval_sg_zonal},
    {"sh", eval_sh},
    {"sh_rotate", eval_sh_rotate},
    {"thread", eval_thread},
    {"visibility", eval_visibility},
    {"woven_area", eval_woven_area},
    {"woven_brdf", eval_woven_brdf},
    {"woven_btf", eval_woven_btf},
    {"woven_yarns", eval_woven_yarns},
};

// The line is not a JSON object.
class UnreadableLine : public EvalError {
 public:
  using EvalError::EvalError;
};

struct Field {
  std::string name;
  std::string text;  // the value as it was written
};

// Characters of a request. Most take a few hundred; a map of `visibility` with 256 x 256 cells
// takes 66,000.
constexpr std::size_t kLongestLine = std::size_t{256} << 10;

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

// Cuts the line into the fields of its object without interpreting the values. So an id can be
// echoed as it was written, and an error can name its field. Whether each value is valid JSON shows
// when it is parsed.
class FieldScanner {
 public:
  explicit FieldScanner(const std::string& line) : line_(line) {}

  std::vector<Field> scan() {
    std::vector<Field> fields;
    expect('{');
    skip_space();
    if (peek() == '}') {
      ++at_;
    } else {
      while (true) {
        skip_space();
        Field field;
        field.name = parse_name();
        expect(':');
        skip_space();
        const std::size_t start = at_;
        skip_value();
        field.text = line_.substr(start, at_ - start);
        while (!field.text.empty() && is_space(field.text.back())) field.text.pop_back();
        fields.push_back(std::move(field));
        if (peek() == ',') {
          ++at_;
          continue;
        }
        expect('}');
        break;
      }
    }
    skip_space();
    if (at_ != line_.size()) fail("text after the object");
    return fields;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw UnreadableLine("not a JSON object: " + what + " at column " + std::to_string(at_ + 1));
  }
  char peek() const { return at_ < line_.size() ? line_[at_] : '\0'; }
  void skip_space() {
    while (at_ < line_.size() && is_space(line_[at_])) ++at_;
  }
  void expect(char c) {
    skip_space();
    if (at_ >= line_.size() || line_[at_] != c) fail(std::string("expected '") + c + "'");
    ++at_;
  }
  void skip_string() {
    const std::size_t start = at_;
    for (++at_; at_ < line_.size() && line_[at_] != '"'; ++at_) {
      if (line_[at_] == '\\') ++at_;
    }
    if (at_ >= line_.size()) {
      at_ = start;
      fail("unfinished string");
    }
    ++at_;
  }
  std::string parse_name() {
    if (peek() != '"') fail("expected a field name");
    const std::size_t start = at_;
    skip_string();
    try {
      return nlohmann::json::parse(line_.substr(start, at_ - start)).get<std::string>();
    } catch (const nlohmann::json::exception&) {
      at_ = start;
      fail("bad field name");
    }
  }
  // Up to the ',' or '}' that ends the field.
  void skip_value() {
    int depth = 0;
    while (at_ < line_.size()) {
      const char c = line_[at_];
      if (c == '"') {
        skip_string();
        continue;
      }
      if (depth == 0 && (c == ',' || c == '}')) return;
      if (c == '{' || c == '[') ++depth;
      if (c == '}' || c == ']') --depth;
      ++at_;
    }
  }

  const std::string& line_;
  std::size_t at_ = 0;
};

// A field's value. Objects inside it may not name a field twice either.
nlohmann::json parse_value(const Field& field) {
  std::vector<std::set<std::string>> names;
  std::string duplicate;
  const auto watch = [&](int, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
    if (event == nlohmann::json::parse_event_t::object_start) names.emplace_back();
    if (event == nlohmann::json::parse_event_t::object_end) names.pop_back();
    if (event == nlohmann::json::parse_event_t::key &&
        !names.back().insert(parsed.get<std::string>()).second) {
      duplicate = parsed.get<std::string>();
    }
    return true;
  };
  nlohmann::json value;
  try {
    value = nlohmann::json::parse(field.text, watch);
  } catch (const nlohmann::json::parse_error&) {
    throw UnreadableLine("field \"" + field.name + "\": not valid JSON");
  } catch (const nlohmann::json::out_of_range&) {
    throw EvalError("field \"" + field.name + "\": the number is not finite in double precision");
  }
  if (!duplicate.empty())
    throw EvalError("duplicate field \"" + field.name + "." + duplicate + "\"");
  return value;
}

bool all_finite(const nlohmann::json& value) {
  if (value.is_structured()) return std::all_of(value.begin(), value.end(), all_finite);
  return !value.is_number_float() || std::isfinite(value.get<double>());
}

nlohmann::json evaluate(const nlohmann::json& request) {
  EvalObject object(request, "");
  const std::string name = object.string("quantity");
  for (const Quantity& quantity : kQuantities) {
    if (name == quantity.name) {
      nlohmann::json value = quantity.evaluate(object);
      if (!all_finite(value))
        throw EvalError("the value of \"" + name + "\" is not finite for these fields");
      return value;
    }
  }
  std::string known;
  for (const Quantity& quantity : kQuantities)
    known += (known.empty() ? "" : ", ") + std::string(quantity.name);
  throw EvalError("field \"quantity\": unknown quantity \"" + name + "\"; known: " + known);
}

// {"id":…,"key":payload}, both already JSON; no id if it is empty.
std::string answer_text(const std::string& id, const char* key, const std::string& payload) {
  std::string text = "{";
  if (!id.empty()) text.append("\"id\":").append(id).append(",");
  text.append("\"").append(key).append("\":").append(payload).append("}");
  return text;
}

struct Answer {
  std::string text;
  bool has_value;
};

Answer answer_line(const std::string& line) {
  std::string id;  // as it was written; empty: none
  try {
    if (line.size() > kLongestLine) {
      throw UnreadableLine("longer than " + std::to_string(kLongestLine) + " characters");
    }
    // The JSON library takes a zero byte for the end of its input.
    if (line.find('\0') != std::string::npos) throw UnreadableLine("holds a zero byte");
    if (is_nested_too_deeply(line)) {
      throw UnreadableLine("nested deeper than " + std::to_string(kMaxJsonDepth));
    }
    const std::vector<Field> fields = FieldScanner(line).scan();
    // The id first, so that errors in other fields carry it.
    std::string duplicate;
    std::set<std::string> names;
    for (const Field& field : fields) {
      if (!names.insert(field.name).second && duplicate.empty()) duplicate = field.name;
      if (field.name != "id") continue;
      id = field.text;
    }
    nlohmann::json request = nlohmann::json::object();
    std::string error;
    for (const Field& field : fields) {
      try {
        nlohmann::json value = parse_value(field);
        if (field.name != "id") request[field.name] = std::move(value);
      } catch (const UnreadableLine&) {
        throw;
      } catch (const EvalError& e) {
        // An id is echoed, not interpreted: any JSON will do. Other errors wait until the whole
        // line proved readable.
        if (field.name != "id" && error.empty()) error = e.what();
      }
    }
    if (!duplicate.empty()) {
      if (duplicate == "id") id.clear();
      throw EvalError("duplicate field \"" + duplicate + "\"");
    }
    if (!error.empty()) throw EvalError(error);
    const nlohmann::json value = evaluate(request);
    return {answer_text(id, "value", value.dump()), true};
  } catch (const EvalError& e) {
    if (dynamic_cast<const UnreadableLine*>(&e) != nullptr) id = "null";
    // Parts of a line may be invalid UTF-8, which an answer must not repeat.
    const std::string message =
        nlohmann::json(e.what()).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return {answer_text(id, "error", message), false};
  }
}

// The next line. Of a line that is too long it holds only enough to show that. False at the end of
// the stream.
bool read_line(std::istream& in, std::string& line) {
  constexpr int kEnd = std::char_traits<char>::eof();
  line.clear();
  while (line.size() <= kLongestLine) {
    const int c = in.rdbuf()->sbumpc();
    if (c == '\n') return true;
    if (c == kEnd) return !line.empty();
    line += static_cast<char>(c);
  }
  return true;
}

}  // namespace

int run_eval(std::istream& in, std::ostream& out) {
  int status = 0;
  std::string line;
  while (read_line(in, line)) {
    const bool is_cut = line.size() > kLongestLine;
    if (!is_cut && std::all_of(line.begin(), line.end(), is_space)) continue;
    const Answer answer = answer_line(line);
    if (!answer.has_value) status = 1;
    out << answer.text << '\n' << std::flush;
    if (!out) return 1;
    if (is_cut) in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return status;
}

}  // namespace heddle
