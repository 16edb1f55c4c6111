#include "pipeline/eval/eval.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "fibers/math/spherical_harmonics.h"
#include "fibers/scattering/sg_scatter.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

using Json = nlohmann::json;

struct Outcome {
  int status;
  std::vector<std::string> lines;
};

Outcome run(const std::string& input) {
  std::istringstream in(input);
  std::ostringstream out;
  Outcome result;
  result.status = run_eval(in, out);
  std::istringstream lines(out.str());
  for (std::string line; std::getline(lines, line);) result.lines.push_back(line);
  return result;
}

Json answer_line(const std::string& line) {
  const Outcome result = run(line + "\n");
  EXPECT_EQ(result.lines.size(), 1U) << line;
  return Json::parse(result.lines.at(0));
}

Json value_of(const std::string& line) {
  const Json json = answer_line(line);
  EXPECT_TRUE(json.contains("value")) << line << "\n" << json;
  return json.value("value", Json());
}

// The error of a bad line, which must have status 1 and no value.
std::string error_of(const std::string& line) {
  EXPECT_EQ(run(line).status, 1) << line;
  const Json json = answer_line(line);
  EXPECT_FALSE(json.contains("value")) << line;
  return json.value("error", std::string());
}

const std::string kFiber =
    R"("fiber":{"color_r":[0.745,0.008,0.07],"color_tt":[0.62,0.553,0.562],"beta_r_deg":1,"beta_tt_deg":10,"gamma_tt_deg":19.823})";

FiberScattering fiber() {
  return {{0.745, 0.008, 0.07}, {0.62, 0.553, 0.562}, radians(1), radians(10), radians(19.823)};
}

void expect_color(const Json& json, const Rgbd& color) {
  ASSERT_EQ(json.size(), 3U);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(json[static_cast<std::size_t>(c)].get<double>(), color[c]);
}

TEST(EvalFormat, AnswersKeepTheOrderAndBlankLinesAreSkipped) {
  const Outcome result =
      run("\n  \t\n{\"quantity\":\"sg_mass\",\"sharpness\":0,\"id\":1}\r\n\n{\"id\":2}\n"
          "{\"id\":3,\"quantity\":\"sg_mass\",\"sharpness\":1}");
  EXPECT_EQ(result.status, 1);
  ASSERT_EQ(result.lines.size(), 3U);
  EXPECT_EQ(result.lines[0], "{\"id\":1,\"value\":12.566370614359172}");
  EXPECT_EQ(result.lines[1], "{\"id\":2,\"error\":\"missing field \\\"quantity\\\"\"}");
  EXPECT_EQ(result.lines[2].substr(0, 15), "{\"id\":3,\"value\"");
  EXPECT_EQ(run("{\"quantity\":\"sg_mass\",\"sharpness\":0}\n").status, 0);
  EXPECT_EQ(run("").status, 0);
}

TEST(EvalFormat, TheIdIsEchoedAsItWasWritten) {
  for (const std::string id :
       {"1", "1.0", "1e2", "-0", "123456789012345678901234567890", "\"a\\u00e9\\/b\"", "null",
        "true", "[1, {\"b\":2, \"a\": \"},]\"}]", "{ \"x\" : [ ] }"}) {
    EXPECT_EQ(run("{\"quantity\":\"sg_mass\", \"id\" : " + id + " ,\"sharpness\":0}").lines.at(0),
              "{\"id\":" + id + ",\"value\":12.566370614359172}");
    EXPECT_EQ(run("{\"quantity\":\"sg_mass\",\"id\":" + id + "}").lines.at(0),
              "{\"id\":" + id + ",\"error\":\"missing field \\\"sharpness\\\"\"}");
  }
  EXPECT_EQ(run("{\"quantity\":\"sg_mass\",\"sharpness\":0}").lines.at(0),
            "{\"value\":12.566370614359172}");
}

TEST(EvalFormat, AnUnreadableLineHasIdNullAndDoesNotStopTheStream) {
  for (const std::string line : {"x",
                                 "{",
                                 "}",
                                 "[]",
                                 "3",
                                 "\"quantity\"",
                                 "{\"id\":1",
                                 "{\"id\":1,}",
                                 "{\"id\":1} {}",
                                 "{\"id\" 1}",
                                 "{\"id\":}",
                                 "{\"id\":1,\"quantity\":\"sg_mass\",\"sharpness\":NaN}",
                                 "{\"id\":1,\"a\":1 2}",
                                 "{\"id\":1,\"a\":[1}",
                                 "{\"id\":1,a:2}",
                                 "{\"id\":\"\xff\"}",
                                 "{\"id\":1,\"a\xff\":2}",
                                 "{\"id\":1,\"a\":\"unfinished}",
                                 "{,}",
                                 "{\"id\":1]}"}) {
    const Outcome result = run(line + "\n{\"quantity\":\"sg_mass\",\"sharpness\":0}\n");
    ASSERT_EQ(result.lines.size(), 2U) << line;
    const Json json = Json::parse(result.lines[0]);
    EXPECT_TRUE(json.contains("id") && json["id"].is_null()) << line;
    EXPECT_FALSE(json.value("error", std::string()).empty()) << line;
    EXPECT_EQ(result.lines[1], "{\"value\":12.566370614359172}");
    EXPECT_EQ(result.status, 1);
  }
}

TEST(EvalFormat, EveryTruncationOfALineIsAnAnsweredError) {
  const std::string line = "{\"id\":[7],\"quantity\":\"bcsdf\"," + kFiber +
                           R"(,"wi":[0,1,0],"wo":[0,-1,0],"lobe":"tt"})";
  EXPECT_EQ(run(line).status, 0);
  for (std::size_t length = 1; length < line.size(); ++length) {
    const Json json = answer_line(line.substr(0, length));
    EXPECT_TRUE(json.contains("error") && json["id"].is_null()) << length;
  }
}

TEST(EvalFormat, LinesTooLongOrTooDeepAreAnsweredAndTheStreamGoesOn) {
  const std::string good = R"({"quantity":"sg_mass","sharpness":0})";
  const auto brackets = [](std::size_t depth) {
    return std::string(depth, '[') + std::string(depth, ']');
  };
  const std::string start = R"({"quantity":"sg_mass","sharpness":0,"id":")";
  const std::string longest = start + std::string((256 << 10) - start.size() - 2, 'x') + "\"}";
  EXPECT_EQ(run(longest).status, 0) << "262,144 characters";
  EXPECT_EQ(run(start.substr(0, start.size() - 1) + brackets(63) + "}").status, 0);
  const std::pair<std::string, std::string> bad[] = {
      {longest + " ", "longer than 262144 characters"},
      {std::string(longest.size() + 1, ' '), "longer than 262144 characters"},
      {std::string(3 << 20, '['), "longer than 262144 characters"},
      {start.substr(0, start.size() - 1) + brackets(64) + "}", "nested deeper than 64"},
      {R"({"quantity":"microcylinder","wi":[0,0,1],"wo":[0,0,1],"fabric":{"a":)" +
           brackets(130'000) + "}}",
       "nested deeper than 64"},
      {R"({"quantity":)" + brackets(130'000) + "}", "nested deeper than 64"}};
  for (const auto& [line, error] : bad) {
    const Outcome result = run(line + "\n" + good + "\n");
    EXPECT_EQ(result.status, 1);
    ASSERT_EQ(result.lines.size(), 2U) << error;
    EXPECT_EQ(result.lines[0], "{\"id\":null,\"error\":\"" + error + "\"}");
    EXPECT_EQ(result.lines[1], "{\"value\":12.566370614359172}");
  }
  EXPECT_EQ(run(std::string(3 << 20, '{')).lines.size(), 1U) << "no end of line";
}

// A stream of the same character.
class EndlessBuffer : public std::streambuf {
 public:
  explicit EndlessBuffer(std::size_t blocks) : block_(1 << 20, 'x'), blocks_(blocks) {}

 protected:
  int_type underflow() override {
    if (blocks_ == 0) return traits_type::eof();
    --blocks_;
    setg(block_.data(), block_.data(), block_.data() + block_.size());
    return traits_type::to_int_type(block_[0]);
  }

 private:
  std::string block_;
  std::size_t blocks_;
};

TEST(EvalFormat, AnEndlessLineTakesNoMemory) {
  EndlessBuffer buffer(256);
  std::istream in(&buffer);
  std::ostringstream out;
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  EXPECT_EQ(run_eval(in, out), 1);
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss, before.ru_maxrss + 20'000) << "kilobytes, of a line of 256 MiB";
  EXPECT_EQ(out.str(), "{\"id\":null,\"error\":\"longer than 262144 characters\"}\n");
}

// A stream that counts how often it is flushed.
class CountingBuffer : public std::stringbuf {
 public:
  int flushes = 0;

 protected:
  int sync() override {
    ++flushes;
    return 0;
  }
};

TEST(EvalFormat, EveryAnswerIsFlushed) {
  CountingBuffer buffer;
  std::ostream out(&buffer);
  std::istringstream in("{}\n{}\n\n{}\n");
  run_eval(in, out);
  EXPECT_EQ(buffer.flushes, 3);
}

TEST(EvalFormat, ErrorsNameTheField) {
  const auto names = [](const std::string& line, const std::string& text) {
    const std::string error = error_of(line);
    EXPECT_NE(error.find(text), std::string::npos) << line << "\n" << error;
  };
  names(R"({"quantity":"nothing"})", "bcsdf, bcsdf_albedo");
  names(R"({"quantity":3})", "\"quantity\"");
  names(R"({"quantity":"sg_mass"})", "missing field \"sharpness\"");
  names(R"({"quantity":"sg_mass","sharpness":1,"extra":2})", "unknown field \"extra\"");
  names(R"({"quantity":"sg_mass","sharpness":1,"sharpness":1})", "duplicate field \"sharpness\"");
  names(R"({"quantity":"sg_mass","sharpness":"1"})", "\"sharpness\"");
  names(R"({"quantity":"sg_mass","sharpness":-1e-9})", "\"sharpness\"");
  names(R"({"quantity":"sg_mass","sharpness":1e999})", "\"sharpness\"");
  names(R"({"quantity":"sh","order":11,"direction":[0,0,1]})", "\"order\"");
  names(R"({"quantity":"sh","order":-1,"direction":[0,0,1]})", "\"order\"");
  names(R"({"quantity":"sh","order":1.5,"direction":[0,0,1]})", "\"order\"");
  names(R"({"quantity":"sh","order":1,"direction":[0,0,1.002]})", "\"direction\"");
  names(R"({"quantity":"sh","order":1,"direction":[0,0]})", "\"direction\"");
  names(R"({"quantity":"sh","order":1,"direction":[0,0,"1"]})", "\"direction\"");
  names(
      R"({"quantity":"sh_rotate","order":0,"rotation":[1,0,0,0,1,0,0,0,1.01],"coefficients":[1]})",
      "\"rotation\"");
  names(R"({"quantity":"sh_rotate","order":0,"rotation":[1,0,0,0,1,0,0,0,-1],"coefficients":[1]})",
        "\"rotation\"");
  names(R"({"quantity":"sh_rotate","order":1,"rotation":[1,0,0,0,1,0,0,0,1],"coefficients":[1]})",
        "\"coefficients\"");
  names("{\"quantity\":\"bcsdf_albedo\"," + kFiber + ",\"theta_i_deg\":90.1}", "\"theta_i_deg\"");
  names("{\"quantity\":\"bcsdf\"," + kFiber + R"(,"wi":[0,1,0],"wo":[0,1,0],"lobe":"trt"})",
        "\"lobe\"");
  names("{\"quantity\":\"sg_scatter\"," + kFiber +
            R"(,"axis":[0,1,0],"sharpness":1,"wo":[0,1,0],"method":"fast"})",
        "\"method\"");
  names("{\"quantity\":\"sg_scatter\"," + kFiber + R"(,"axis":[0,1,0],"sharpness":1,"wo":[0,1,0]})",
        "missing field \"method\"");
  const auto with_fiber = [](const std::string& fields) {
    return "{\"quantity\":\"bcsdf_albedo\",\"theta_i_deg\":0,\"fiber\":{" + fields + "}}";
  };
  const std::string colors = R"("color_r":[0,0,0],"color_tt":[1,1,1],)";
  names(with_fiber(colors + R"("beta_r_deg":1,"beta_tt_deg":1)"),
        "missing field \"fiber.gamma_tt_deg\"");
  names(with_fiber(colors + R"("beta_r_deg":0,"beta_tt_deg":1,"gamma_tt_deg":1)"),
        "\"fiber.beta_r_deg\"");
  names(with_fiber(colors + R"("beta_r_deg":1,"beta_tt_deg":1,"gamma_tt_deg":1,"x":0)"),
        "unknown field \"fiber.x\"");
  names(with_fiber(colors + R"("beta_r_deg":1,"beta_tt_deg":1,"gamma_tt_deg":1,"beta_r_deg":1)"),
        "\"fiber.beta_r_deg\"");
  names(
      with_fiber(
          R"("color_r":[0,0,1.5],"color_tt":[1,1,1],"beta_r_deg":1,"beta_tt_deg":1,"gamma_tt_deg":1)"),
      "\"fiber.color_r\"");
  names(R"({"quantity":"bcsdf_albedo","theta_i_deg":0,"fiber":3})", "\"fiber\"");
}

TEST(EvalFormat, ADuplicateFieldKeepsTheId) {
  EXPECT_EQ(answer_line(R"({"id":5,"quantity":"sg_mass","sharpness":1,"sharpness":1})")["id"], 5);
}

TEST(EvalAgreement, NumbersReadBackExactly) {
  const Vec3d wi(0.6, 0.8, 0.0);
  const Vec3d wo(-0.6, 0.0, 0.8);
  expect_color(
      value_of("{\"quantity\":\"bcsdf\"," + kFiber + R"(,"wi":[0.6,0.8,0],"wo":[-0.6,0,0.8]})"),
      evaluate_bcsdf(fiber(), wi, wo));
  expect_color(value_of("{\"quantity\":\"bcsdf\"," + kFiber +
                        R"(,"wi":[0.6,0.8,0],"wo":[-0.6,0,0.8],"lobe":"r"})"),
               evaluate_bcsdf(fiber(), wi, wo, Lobe::kR));
  expect_color(value_of("{\"quantity\":\"bcsdf_albedo\"," + kFiber + R"(,"theta_i_deg":-30})"),
               bcsdf_albedo(fiber(), radians(-30.0)));
  const std::pair<const char*, SgMethod> methods[] = {{"printed", SgMethod::kPrinted},
                                                      {"default", SgMethod::kDefault},
                                                      {"quadrature", SgMethod::kQuadrature}};
  for (const auto& [name, method] : methods) {
    expect_color(
        value_of("{\"quantity\":\"sg_scatter\"," + kFiber +
                 R"(,"axis":[0.6,0.8,0],"sharpness":150,"wo":[-0.6,0,0.8],"lobe":"tt","method":")" +
                 name + "\"}"),
        sg_scatter(fiber(), {wi, 150.0}, wo, method, Lobe::kTt));
  }
  const Json rows =
      value_of("{\"quantity\":\"bcsdf_sh\"," + kFiber + R"(,"theta_o_deg":20,"order":3})");
  const std::vector<Rgbd> exact = bcsdf_sh(fiber(), radians(20.0), 3);
  ASSERT_EQ(rows.size(), 16U);
  for (std::size_t j = 0; j < 16; ++j) expect_color(rows[j], exact[j]);
}

TEST(EvalLaw, BasisQuantities) {
  // Known values: sqrt(1 / 4 pi), and band 1 in the order y, z, x.
  const Json y = value_of(R"({"quantity":"sh","order":1,"direction":[0,0,1.0005]})");
  ASSERT_EQ(y.size(), 4U);
  EXPECT_NEAR(y[0].get<double>(), 0.28209479177387814, 1e-15);
  EXPECT_NEAR(y[2].get<double>(), 0.48860251190291992, 1e-15);
  EXPECT_EQ(y[1].get<double>(), 0.0);

  // A quarter turn about z takes the lobe along x (index 3) to y (index 1).
  const Json turned = value_of(
      R"({"quantity":"sh_rotate","order":1,"rotation":[0,-1,0,1,0,0,0,0,1],"coefficients":[0.5,0,0,1]})");
  EXPECT_NEAR(turned[0].get<double>(), 0.5, 1e-14);
  EXPECT_NEAR(turned[1].get<double>(), 1.0, 1e-14);
  EXPECT_NEAR(turned[3].get<double>(), 0.0, 1e-14);

  EXPECT_NEAR(value_of(R"({"quantity":"sg_mass","sharpness":3})").get<double>(),
              2 * kPi * (1 - std::exp(-6.0)) / 3, 1e-14);
  const Json product = value_of(
      R"({"quantity":"sg_product","axis_a":[1,0,0],"sharpness_a":3,"axis_b":[0,1,0],"sharpness_b":4})");
  EXPECT_NEAR(product["sharpness"].get<double>(), 5.0, 1e-14);
  EXPECT_NEAR(product["log_scale"].get<double>(), -2.0, 1e-14);
  EXPECT_NEAR(product["axis"][0].get<double>(), 0.6, 1e-15);
  EXPECT_NEAR(product["axis"][1].get<double>(), 0.8, 1e-15);
  const Json zonal = value_of(R"({"quantity":"sg_zonal","sharpness":2,"order":1})");
  EXPECT_NEAR(zonal[0].get<double>(), 0.28209479177387814, 1e-15);
  EXPECT_NEAR(zonal[1].get<double>(), 0.48860251190291992 * (1 / std::tanh(2.0) - 0.5), 1e-15);
}

TEST(EvalStability, ValuesAreFiniteAtTheEndsOfTheRanges) {
  for (const char* beta : {"0.01", "90"}) {
    const std::string ends =
        std::string(R"("fiber":{"color_r":[0,1,0.5],"color_tt":[1,0,0.5],"beta_r_deg":)") + beta +
        ",\"beta_tt_deg\":" + beta + ",\"gamma_tt_deg\":" + (beta[0] == '0' ? "0.01" : "360") + "}";
    EXPECT_EQ(run("{\"quantity\":\"bcsdf\"," + ends + R"(,"wi":[1,0,0],"wo":[-1,0,0]})").status, 0);
    EXPECT_EQ(run("{\"quantity\":\"bcsdf_sh\"," + ends + R"(,"theta_o_deg":90,"order":10})").status,
              0);
    for (const char* sharpness : {"0", "1e-300", "1e8", "1e15"}) {
      for (const char* method : {"printed", "default", "quadrature"}) {
        EXPECT_EQ(run("{\"quantity\":\"sg_scatter\"," + ends +
                      R"(,"axis":[0,1,0],"wo":[0,-1,0],"sharpness":)" + sharpness +
                      ",\"method\":\"" + method + "\"}")
                      .status,
                  0)
            << beta << " " << sharpness << " " << method;
      }
      EXPECT_EQ(
          run(std::string(R"({"quantity":"sg_zonal","order":10,"sharpness":)") + sharpness + "}")
              .status,
          0);
      EXPECT_EQ(run(std::string(R"({"quantity":"sg_mass","sharpness":)") + sharpness + "}").status,
                0);
    }
  }
}

TEST(EvalFormat, EveryDamagedLineHasOneAnswerPerLine) {
  const std::string line =
      R"({"id":[7,{"a":"b\n"}],"quantity":"sh","order":1,"direction":[0,0.6,-0.8]})";
  for_each_mutation(
      line, 1, std::string_view("\0\"\\[]{},:e-9 \xff", 14), [&](const std::string& damaged) {
        if (damaged.find_first_not_of(" \t\r\n") == std::string::npos) return;
        const Outcome result = run(damaged + "\n");
        const auto lines = 1 + std::count(damaged.begin(), damaged.end(), '\n');
        ASSERT_EQ(result.lines.size(), static_cast<std::size_t>(lines)) << damaged;
        for (const std::string& text : result.lines) {
          const Json json = Json::parse(text, nullptr, false);
          ASSERT_TRUE(json.is_object() && json.contains("value") != json.contains("error"))
              << damaged << "\n"
              << text;
        }
      });
}

}  // namespace
}  // namespace heddle
