"""``kinds.put_product`` in LLVM IR, with eight columns at a time.

It is written by hand because no vectorization pass runs over the subset's code.
"""


def _columns(width: int) -> str:
    """Return a loop that computes ``width`` columns' sums, which stay in a vector register."""
    kind, w = f"<{width} x double>", width
    return f"""take{w}:
br label %loop{w}
loop{w}:
%k{w} = phi i64 [ 0, %take{w} ], [ %next{w}, %loop{w} ]
%row{w} = phi ptr [ %top, %take{w} ], [ %below{w}, %loop{w} ]
%sum{w} = phi {kind} [ zeroinitializer, %take{w} ], [ %new{w}, %loop{w} ]
%at{w} = getelementptr double, ptr %factors, i64 %k{w}
%factor{w} = load double, ptr %at{w}, align 8
%one{w} = insertelement {kind} poison, double %factor{w}, i64 0
%all{w} = shufflevector {kind} %one{w}, {kind} poison, <{w} x i32> zeroinitializer
%x{w} = load {kind}, ptr %row{w}, align 8
%new{w} = call {kind} @llvm.fma.v{w}f64({kind} %all{w}, {kind} %x{w}, {kind} %sum{w})
%below{w} = getelementptr double, ptr %row{w}, i64 %width
%next{w} = add i64 %k{w}, 1
%more{w} = icmp slt i64 %next{w}, %count
br i1 %more{w}, label %loop{w}, label %end{w}
end{w}:
store {kind} %new{w}, ptr %to, align 8
br label %columns
"""


PUT_PRODUCT = f"""declare <1 x double> @llvm.fma.v1f64(<1 x double>, <1 x double>, <1 x double>)
declare <8 x double> @llvm.fma.v8f64(<8 x double>, <8 x double>, <8 x double>)
define internal void @put_product(ptr noalias %out, i64 %size, ptr %factors, i64 %count,
                                  ptr %rows, i64 %width) nounwind {{
begin:
br label %columns
columns:
%j = phi i64 [ 0, %begin ], [ %j8, %end8 ], [ %j1, %end1 ]
%to = getelementptr double, ptr %out, i64 %j
%top = getelementptr double, ptr %rows, i64 %j
%j8 = add i64 %j, 8
%j1 = add i64 %j, 1
%eight = icmp sle i64 %j8, %size
br i1 %eight, label %take8, label %rest
rest:
%one = icmp slt i64 %j, %size
br i1 %one, label %take1, label %done
{_columns(8)}{_columns(1)}done:
ret void
}}"""
"""Source of ``put_product`` in LLVM IR. Its arguments are ``out`` and its size, ``factors`` and
their number, ``rows`` and the distance between them."""
