// The few parts of NUnit that the tests use, and a runner for them.

using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;

namespace UnityEngine.TestTools
{
    public static class LogAssert { public static bool ignoreFailingMessages { get; set; } }
}

namespace NUnit.Framework
{
    public sealed class TestAttribute : Attribute { }
    public sealed class TearDownAttribute : Attribute { }
    public sealed class AssertionException : Exception { public AssertionException(string text) : base(text) { } }
    public sealed class IgnoreException : Exception { public IgnoreException(string text) : base(text) { } }

    public delegate void TestDelegate();

    public static class Assert
    {
        public static void Ignore(string why) { throw new IgnoreException(why); }
        public static void Fail(string why) { throw new AssertionException(why); }
        public static void IsTrue(bool holds, string what = "a condition") { if (!holds) Fail("expected " + what); }
        public static void IsFalse(bool holds, string what = "not a condition") { IsTrue(!holds, what); }
        public static void IsNull(object o) { IsTrue(o == null, "null, found " + o); }
        public static void AreEqual(object expected, object found, string what = "")
        {
            IsTrue(Equals(expected, found), what + " " + expected + ", found " + found);
        }
        public static void AreEqual(float expected, float found, float within, string what = "")
        {
            IsTrue(Math.Abs(expected - found) <= within, what + " " + expected + " within " + within + ", found " + found);
        }
        public static void Less(float a, float b, string what = "") { IsTrue(a < b, what + " below " + b + ", found " + a); }
        public static void Greater(float a, float b, string what = "") { IsTrue(a > b, what + " above " + b + ", found " + a); }
        public static T Throws<T>(TestDelegate work) where T : Exception
        {
            try { work(); }
            catch (T error) { return error; }
            Fail("expected " + typeof(T).Name);
            return null;
        }
    }

    public static class StringAssert
    {
        public static void Contains(string part, string text)
        {
            Assert.IsTrue(text != null && text.Contains(part), "\"" + part + "\" in \"" + text + "\"");
        }
    }

    /// <summary>Runs the tests of an assembly. The result is the number of failures.</summary>
    public static class Runner
    {
        public static int Run(Assembly assembly, string only)
        {
            int passed = 0, failed = 0, ignored = 0;
            IEnumerable<MethodInfo> tests = assembly.GetTypes().SelectMany(type => type.GetMethods())
                .Where(m => m.GetCustomAttribute<TestAttribute>() != null)
                .Where(m => only == null || (m.DeclaringType.Name + "." + m.Name).Contains(only));
            foreach (MethodInfo test in tests)
            {
                string name = test.DeclaringType.Name + "." + test.Name;
                try
                {
                    object fixture = Activator.CreateInstance(test.DeclaringType);
                    try { test.Invoke(fixture, null); }
                    finally { TearDown(fixture); }
                    Console.WriteLine("ok       " + name);
                    passed++;
                }
                catch (TargetInvocationException error) when (error.InnerException is IgnoreException)
                {
                    Console.WriteLine("skipped  " + name + ": " + error.InnerException.Message);
                    ignored++;
                }
                catch (TargetInvocationException error)
                {
                    Console.WriteLine("FAILED   " + name + ": " + error.InnerException);
                    failed++;
                }
            }
            Console.WriteLine(passed + " passed, " + failed + " failed, " + ignored + " skipped");
            return failed + (passed == 0 ? 1 : 0);
        }

        private static void TearDown(object fixture)
        {
            foreach (MethodInfo method in fixture.GetType().GetMethods())
                if (method.GetCustomAttribute<TearDownAttribute>() != null) method.Invoke(fixture, null);
        }
    }
}
