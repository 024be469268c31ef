using System;
using System.IO;
using NUnit.Framework;
using Unic;

/// <summary>The model that the tests run on: the file that UNIC_TEST_MODEL names.</summary>
internal static class TestModel
{
    private static byte[] bytes;

    /// <summary>A new asset of the file. The test is ignored without one.</summary>
    internal static UnicModel Asset()
    {
        string path = Environment.GetEnvironmentVariable("UNIC_TEST_MODEL");
        if (string.IsNullOrEmpty(path)) Assert.Ignore("UNIC_TEST_MODEL names no .unic file");
        if (bytes == null) bytes = File.ReadAllBytes(path);
        return UnicModel.FromBytes("tshirt", bytes);
    }
}
