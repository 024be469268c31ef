using System.Reflection;
using NUnit.Framework;

/// <summary>Runs the tests under mono: MonoTests.exe [PART_OF_A_NAME].</summary>
internal static class Program
{
    private static int Main(string[] arguments)
    {
        return Runner.Run(Assembly.GetExecutingAssembly(), arguments.Length > 0 ? arguments[0] : null);
    }
}
