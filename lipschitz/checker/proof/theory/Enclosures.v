(** Intervals of the functions between layers, by which networks are evaluated: the values of activations from the
    exponential of Fixed.v, as multiples of 2^-64 rounded outwards. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Exponential Activations Algebra Form Network Checker Fixed Normal Meaning Steepness Lower
  Values.
Import ListNotations.
Open Scope Z_scope.

(** ln (1 + e), e >= 0: twice the series of artanh (e / (2 + e)), widened by 2^-196, where the exponential confirms it;
    else from 0 to e. *)
Fixpoint log_series (n : nat) (k : Z) (square power sum : fixed) : fixed :=
  match n with
  | O => sum
  | S n' => log_series n' (k + 2) square (mulF power square) (addF sum (overF power k))
  end.
Definition confirmed_log (low high : Z) (e : fixed) : fixed :=
  let square := Z.shiftl unit_of_fixed 256 in
  (if (0 <=? low) && (square <=? fst (exp_of_minus (low, low)) * (unit_of_fixed + greatest 0 (fst e))) then low else 0,
   if (0 <=? high) && (snd (exp_of_minus (high, high)) * (unit_of_fixed + snd e) <=? square) then high else snd e).
Definition log_of_one_plus (e : fixed) : fixed :=
  let z := divF e (addF (addF oneF oneF) e) in
  let c := log_series 85 1 (mulF z z) z (0, 0) in
  confirmed_log (2 * fst c - Z.shiftl 1 60) (2 * snd c + Z.shiftl 1 60) e.

Definition selu_scaleF : fixed := ratioF 10507009873554805 10000000000000000.
Definition selu_alphaF : fixed := ratioF 16732632423543772 10000000000000000.
Definition exp_of_minus_size (t : dyadic) : fixed := exp_of_minus (of_dyadic (abs t)).
Definition sigmoidF (t : dyadic) : fixed :=
  let e := exp_of_minus_size t in divF (if is_nonnegative t then oneF else e) (addF oneF e).
Definition tanhF (t : dyadic) : fixed :=
  let e := exp_of_minus_size (shift 1 t) in
  let v := divF (addF oneF (negF e)) (addF oneF e) in if is_nonnegative t then v else negF v.
Definition softplusF (t : dyadic) : fixed :=
  addF (if is_nonnegative t then of_dyadic t else (0, 0)) (log_of_one_plus (exp_of_minus_size t)).
Definition eluF (t : dyadic) : fixed :=
  if is_nonnegative t then of_dyadic t else addF (exp_of_minus_size t) (negF oneF).
Definition seluF (t : dyadic) : fixed :=
  mulF selu_scaleF (if is_nonnegative t then of_dyadic t
                    else mulF selu_alphaF (addF (exp_of_minus_size t) (negF oneF))).
Definition value_at (a : activation) (t : dyadic) : fixed :=
  match a with
  | Tanh => tanhF t
  | Sigmoid => sigmoidF t
  | Softplus => softplusF t
  | Elu => eluF t
  | Selu => seluF t
  | Silu => mulF (of_dyadic t) (sigmoidF t)
  | Gelu => mulF (of_dyadic t) (probabilityF t)
  | Relu | Sorted _ | Keeping _ _ => (0, 0)
  end.

(** SiLU and GELU fall up to their minimum, which lies between the first two numbers, and rise behind; they are nowhere
    below the third one. *)
Definition minimum_of (a : activation) : dyadic * dyadic * dyadic :=
  match a with
  | Gelu => ((-1576622, -21), (-1576620, -21), (-1425822, -23))
  | _ => ((-1340568, -20), (-1340567, -20), (-72998, -18))
  end.
Definition smaller (x y : dyadic) : dyadic := if at_most x y then x else y.
Definition below (x y : dyadic) : bool := negb (at_most y x).
Definition values_between (a : activation) (i : dyadic * dyadic) : dyadic * dyadic :=
  let v := value_at a (fst i) in
  let w := if same (fst i) (snd i) then v else value_at a (snd i) in
  let low := (fst v, -256) in
  let high := (snd w, -256) in
  if is_rising a then (floor_to (-64) low, ceil_to (-64) high)
  else
    let '(from, to, value) := minimum_of a in
    (floor_to (-64) (if below (snd i) from || below to (fst i) then smaller low (fst w, -256) else value),
     ceil_to (-64) (larger high (snd v, -256))).

Definition least_ends (i j : dyadic * dyadic) : dyadic * dyadic := (smaller (fst i) (fst j), smaller (snd i) (snd j)).
Definition greatest_ends (i j : dyadic * dyadic) : dyadic * dyadic := (larger (fst i) (fst j), larger (snd i) (snd j)).
Fixpoint activated_ends (a : activation) (b : box) : box :=
  match a with
  | Sorted s => sorted_by least_ends greatest_ends s b
  | Keeping n c => activated_ends c (firstn n b) ++ skipn n b
  | Relu => map relu_ends b
  | _ => map (values_between a) b
  end.
Fixpoint plus_ends (a b : box) : box :=
  match a, b with
  | (l, h) :: a', (m, k) :: b' => (add l m, add h k) :: plus_ends a' b'
  | [], _ => b
  | _, [] => a
  end.
Definition affine_ends (l : layerD) (b : box) : box :=
  plus_ends (map (fun row => row_ends row b) (fst l)) (map (fun c => (c, c)) (snd l)).
Fixpoint network_ends (between : list activation) (hidden : list layerD) (last : layerD) (b : box) : box :=
  match hidden with
  | [] => affine_ends last b
  | l :: hidden' => network_ends (tl between) hidden' last (activated_ends (hd Relu between) (affine_ends l b))
  end.

Open Scope R_scope.
Lemma at_most_real x y : at_most x y = true -> real x <= real y.
Proof. intros H. apply real_nonnegative in H. rewrite real_add, real_neg in H. lra. Qed.
Lemma negative_real x : is_nonnegative x = false -> real x < 0.
Proof.
  intros H. assert (is_positive (neg x) = true) as N.
  { unfold is_positive, is_nonnegative, neg in *. simpl. apply Z.ltb_lt. apply Z.leb_gt in H. lia. }
  apply real_positive in N. rewrite real_neg in N. lra.
Qed.
Lemma at_most_false x y : at_most x y = false -> real y < real x.
Proof. intros H. apply negative_real in H. rewrite real_add, real_neg in H. lra. Qed.

Lemma inside_zero : inside (0, 0)%Z 0. Proof. unfold inside. simpl. lra. Qed.
Lemma inside_number n : inside (n, n) (IZR n / U).
Proof. unfold inside. pose proof U_positive. replace (IZR n / U * U) with (IZR n) by (field; lra). simpl. lra. Qed.
Lemma inside_confirmed low high e x l : inside e x -> 0 <= x -> exp l = 1 + x -> inside (confirmed_log low high e) l.
Proof.
  intros [A B] X E. unfold confirmed_log. pose proof U_positive as P. set (square := Z.shiftl unit_of_fixed 256).
  assert (IZR square = U * U) as S by (unfold square; rewrite IZR_shiftl, U_is, U_integer by lia; reflexivity).
  clearbody square. split; cbn [fst snd].
  - destruct (Z.leb_spec 0 low) as [Z0|]; cbn [andb].
    set (g := greatest 0 (fst e)). assert (0 <= IZR g <= x * U) as Gx.
    { unfold g, greatest. destruct (Z.leb_spec 0 (fst e)) as [N|N]; [apply IZR_le in N; lra|].
      pose proof (Rmult_le_pos x U X (Rlt_le _ _ P)). lra. }
    destruct (Z.leb_spec square (fst (exp_of_minus (low, low)) * (unit_of_fixed + g))) as [H|].
    + apply IZR_le in Z0, H. rewrite mult_IZR, plus_IZR, U_integer, S in H. set (a := IZR low / U).
      assert (0 <= a) by (apply Rmult_le_pos; [lra|left; now apply Rinv_0_lt_compat]).
      destruct (inside_exp _ a (inside_number low) ltac:(auto)) as [K _].
      assert (IZR low = a * U) as -> by (unfold a; field; lra). apply Rmult_le_compat_r; [lra|].
      apply exp_before. rewrite E. pose proof (exp_opp a) as O. pose proof (exp_pos (- a)). pose proof (exp_pos a).
      set (p := IZR (fst (exp_of_minus (low, low)))) in *. set (q := exp (- a)) in *. clearbody p q a.
      assert (p * (U + IZR g) <= q * U * (U + x * U)) as G.
      { apply Rle_trans with (q * U * (U + IZR g)); [apply Rmult_le_compat_r; lra|].
        apply Rmult_le_compat_l; [|lra]. apply Rmult_le_pos; lra. }
      assert (U * U * 1 <= U * U * (q * (1 + x))) as G'
        by (replace (U * U * (q * (1 + x))) with (q * U * (U + x * U)) by ring; lra).
      apply Rmult_le_reg_l in G'; [|nra]. apply (Rmult_le_compat_l (exp a)) in G'; [|lra].
      replace (exp a * (q * (1 + x))) with (exp a * q * (1 + x)) in G' by ring. rewrite O in G'. lra.
    + assert (0 <= l) by (apply exp_before; rewrite exp_0; lra). nra.
    + assert (0 <= l) by (apply exp_before; rewrite exp_0; lra). nra.
  - assert (l * U <= IZR (snd e)) as Fallback.
    { assert (l <= x) by (apply exp_before; rewrite E; apply exp_above_line). nra. }
    destruct (Z.leb_spec 0 high) as [Z0|]; cbn [andb]; auto.
    destruct (Z.leb_spec (snd (exp_of_minus (high, high)) * (unit_of_fixed + snd e)) square) as [H|]; auto.
    apply IZR_le in Z0, H. rewrite mult_IZR, plus_IZR, U_integer, S in H. set (a := IZR high / U).
    assert (0 <= a) by (apply Rmult_le_pos; [lra|left; now apply Rinv_0_lt_compat]).
    destruct (inside_exp _ a (inside_number high) ltac:(auto)) as [_ K].
    assert (IZR high = a * U) as -> by (unfold a; field; lra). apply Rmult_le_compat_r; [lra|].
    apply exp_before. rewrite E. pose proof (exp_opp a) as O. pose proof (exp_pos (- a)). pose proof (exp_pos a).
    set (p := IZR (snd (exp_of_minus (high, high)))) in *. set (q := exp (- a)) in *. clearbody p q a.
    assert (q * U * (U + x * U) <= U * U) as G.
    { eapply Rle_trans; [|exact H]. assert (0 <= x * U) by nra. apply Rmult_le_compat; try nra. }
    assert (U * U * (q * (1 + x)) <= U * U * 1) as G'
      by (replace (U * U * (q * (1 + x))) with (q * U * (U + x * U)) by ring; lra).
    apply Rmult_le_reg_l in G'; [|nra]. apply (Rmult_le_compat_l (exp a)) in G'; [|lra].
    replace (exp a * (q * (1 + x))) with (exp a * q * (1 + x)) in G' by ring. rewrite O in G'. lra.
Qed.

Lemma inside_log e x l : inside e x -> 0 <= x -> exp l = 1 + x -> inside (log_of_one_plus e) l.
Proof. apply inside_confirmed. Qed.

Lemma inside_exp_size t : inside (exp_of_minus_size t) (exp (- Rabs (real t))).
Proof.
  apply inside_exp; [|apply Rabs_pos]. rewrite <- real_abs. apply inside_dyadic.
Qed.
Lemma inside_one_and a x : inside a x -> inside (addF oneF a) (1 + x).
Proof. apply inside_add, inside_one. Qed.
Lemma inside_sigmoid t : inside (sigmoidF t) (sigmoid (real t)).
Proof.
  unfold sigmoidF, sigmoid. pose proof (inside_exp_size t) as E. set (x := real t) in *.
  pose proof (exp_pos (- Rabs x)).
  destruct (is_nonnegative t) eqn:S.
  - apply real_nonnegative in S. fold x in S. rewrite Rabs_pos_eq in * by auto.
    replace (/ (1 + exp (- x))) with (1 / (1 + exp (- x))) by (field; lra).
    apply inside_div; [apply inside_one|now apply inside_one_and|lra].
  - apply negative_real in S. fold x in S. rewrite Rabs_left in * by auto. rewrite Ropp_involutive in *.
    replace (/ (1 + exp (- x))) with (exp x / (1 + exp x)).
    + apply inside_div; [auto|now apply inside_one_and|lra].
    + pose proof (exp_opp x). pose proof (exp_pos (- x)). apply (Rmult_eq_reg_r ((1 + exp x) * (1 + exp (- x))));
      [|nra].
      field_simplify; [|lra|lra]. lra.
Qed.
Lemma tanh_right x : tanh x = (1 - exp (- (2 * x))) / (1 + exp (- (2 * x))).
Proof.
  unfold tanh, sinh, cosh. replace (- (2 * x)) with (- x + - x) by ring. rewrite exp_plus.
  pose proof (exp_opp x). pose proof (exp_pos (- x)). pose proof (exp_pos x). set (e := exp (- x)) in *.
  apply (Rmult_eq_reg_r ((exp x + e) * (1 + e * e))); [|nra].
  replace ((exp x - e) / 2 / ((exp x + e) / 2) * ((exp x + e) * (1 + e * e))) with ((exp x - e) * (1 + e * e))
    by (field; lra).
  replace ((1 - e * e) / (1 + e * e) * ((exp x + e) * (1 + e * e))) with ((1 - e * e) * (exp x + e)) by (field; nra).
  replace ((exp x - e) * (1 + e * e)) with (exp x - e + e * (exp x * e) - e * e * e) by ring.
  replace ((1 - e * e) * (exp x + e)) with (exp x + e - e * (exp x * e) - e * e * e) by ring. rewrite H. ring.
Qed.
Lemma tanh_odd x : tanh (- x) = - tanh x.
Proof. unfold tanh, sinh, cosh. rewrite Ropp_involutive. pose proof (exp_pos x). pose proof (exp_pos (- x)). field.
lra. Qed.
Lemma inside_tanh t : inside (tanhF t) (tanh (real t)).
Proof.
  unfold tanhF. pose proof (inside_exp_size (shift 1 t)) as E. rewrite real_shift in E.
  replace (powerRZ 2 1) with 2 in E by (simpl; ring). set (x := real t) in *.
  assert (inside (divF (addF oneF (negF (exp_of_minus_size (shift 1 t)))) (addF oneF (exp_of_minus_size (shift 1 t))))
    (tanh (Rabs x))) as V.
  { rewrite tanh_right. rewrite Rabs_mult, (Rabs_pos_eq 2) in E by lra. pose proof (exp_pos (- (2 * Rabs x))).
    apply inside_div; [|now apply inside_one_and|lra]. apply inside_one_and, inside_neg, E. }
  destruct (is_nonnegative t) eqn:S.
  - apply real_nonnegative in S. now rewrite Rabs_pos_eq in V.
  - apply negative_real in S. rewrite Rabs_left in V by auto. rewrite <- (Ropp_involutive x), tanh_odd.
    now apply inside_neg.
Qed.
Lemma inside_softplus t : inside (softplusF t) (softplus (real t)).
Proof.
  unfold softplusF. pose proof (inside_exp_size t) as E. set (x := real t) in *. pose proof (exp_softplus x) as S.
  pose proof (exp_pos (- Rabs x)).
  destruct (is_nonnegative t) eqn:N.
  - apply real_nonnegative in N. fold x in N. rewrite Rabs_pos_eq in * by auto.
    replace (softplus x) with (x + (softplus x - x)) by ring. apply inside_add; [apply inside_dyadic|].
    apply (inside_log _ _ _ E); [lra|]. unfold Rminus. rewrite exp_plus, S. pose proof (exp_opp x). lra.
  - apply negative_real in N. fold x in N. rewrite Rabs_left, Ropp_involutive in * by auto.
    rewrite <- (Rplus_0_l (softplus x)). apply inside_add; [apply inside_zero|].
    apply (inside_log _ _ _ E); [lra|auto].
Qed.
Lemma inside_falling t : is_nonnegative t = false ->
  inside (addF (exp_of_minus_size t) (negF oneF)) (falling (real t)) /\ relu (real t) = 0.
Proof.
  intros N. apply negative_real in N. split; [|apply relu_left; lra]. rewrite falling_left by lra.
  pose proof (inside_exp_size t) as E. rewrite Rabs_left, Ropp_involutive in E by auto.
  apply inside_add; auto. apply inside_neg, inside_one.
Qed.
Lemma inside_selu_constants : inside selu_scaleF selu_scale /\ inside selu_alphaF selu_alpha.
Proof.
  unfold selu_scale, selu_alpha. replace (10 ^ 16) with (IZR 10000000000000000) by (simpl; ring).
  split; apply inside_ratio; reflexivity.
Qed.
Theorem value_at_inside a t : is_relu a = false -> is_entrywise a = true ->
  inside (value_at a t) (act a (real t)).
Proof.
  pose proof (inside_dyadic t) as T.
  destruct a; try discriminate; intros _ _; cbn [value_at].
  - apply inside_tanh.
  - apply inside_sigmoid.
  - apply inside_softplus.
  - cbn [act]. unfold eluF. destruct (is_nonnegative t) eqn:N.
    + apply real_nonnegative in N. rewrite relu_right, falling_right, Rplus_0_r by auto. exact T.
    + destruct (inside_falling t N) as [F ->]. rewrite Rplus_0_l. exact F.
  - cbn [act]. unfold seluF. destruct inside_selu_constants as [S A]. destruct (is_nonnegative t) eqn:N.
    + apply real_nonnegative in N. rewrite relu_right, falling_right, Rmult_0_r, Rplus_0_r by auto.
      now apply inside_mul.
    + destruct (inside_falling t N) as [F ->]. rewrite Rmult_0_r, Rplus_0_l, Rmult_assoc.
      apply inside_mul; auto. now apply inside_mul.
  - cbn [act]. unfold Rdiv. apply inside_mul; [exact T|]. apply inside_sigmoid.
  - rewrite gelu_probability. apply inside_mul; [exact T|]. apply inside_normal.
Qed.
