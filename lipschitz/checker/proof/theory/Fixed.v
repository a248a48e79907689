(** Real numbers between integers over 2^256, and the exponential of such: what activations are evaluated with. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Exponential Activations ErrorFunction Algebra Form Network Checker.
Import ListNotations.
Open Scope Z_scope.

(** The real number x is meant where lower <= 2^256 x <= upper. *)
Definition fixed := (Z * Z)%type.
Definition unit_of_fixed : Z := Z.shiftl 1 256.
Definition least (a b : Z) : Z := if a <=? b then a else b.
Definition greatest (a b : Z) : Z := if a <=? b then b else a.
Definition ceil_shift (a n : Z) : Z := - Z.shiftr (- a) n.
Definition ceil_quotient (a b : Z) : Z := - ((- a) / b).

(** In units of 2^u. *)
Definition floor_at (u : Z) (x : dyadic) : Z :=
  let e := snd x - u in if 0 <=? e then Z.shiftl (fst x) e else Z.shiftr (fst x) (- e).
Definition ceil_at (u : Z) (x : dyadic) : Z := - floor_at u (neg x).
Definition floor_to (u : Z) (x : dyadic) : dyadic := if u <=? snd x then x else (floor_at u x, u).
Definition ceil_to (u : Z) (x : dyadic) : dyadic := if u <=? snd x then x else (ceil_at u x, u).

Definition of_dyadic (x : dyadic) : fixed := (floor_at (-256) x, ceil_at (-256) x).
Definition oneF : fixed := (unit_of_fixed, unit_of_fixed).
Definition addF (a b : fixed) : fixed := (fst a + fst b, snd a + snd b).
Definition negF (a : fixed) : fixed := (- snd a, - fst a).
Definition mulF (a b : fixed) : fixed :=
  let (l, h) := a in
  let (m, k) := b in
  let p := l * m in let q := l * k in let r := h * m in let s := h * k in
  (Z.shiftr (least (least p q) (least r s)) 256, ceil_shift (greatest (greatest p q) (greatest r s)) 256).
(** By a positive integer. *)
Definition overF (a : fixed) (n : Z) : fixed := (fst a / n, ceil_quotient (snd a) n).
Definition ratioF (n d : Z) : fixed := (Z.shiftl n 256 / d, ceil_quotient (Z.shiftl n 256) d).
(** By a number of at least 1. *)
Definition divF (a b : fixed) : fixed :=
  let l := Z.shiftl (fst a) 256 in
  let h := Z.shiftl (snd a) 256 in
  let m := greatest unit_of_fixed (fst b) in
  let k := greatest unit_of_fixed (snd b) in
  (l / (if 0 <=? l then k else m), ceil_quotient h (if 0 <=? h then m else k)).

(** sum + term (y/k + y^2/(k (k+1)) + ...), n terms. *)
Fixpoint exp_series (n : nat) (k : Z) (y term sum : fixed) : fixed :=
  match n with
  | O => sum
  | S n' => let t := overF (mulF term y) k in exp_series n' (k + 1) y t (addF sum t)
  end.
Fixpoint squares (n : nat) (f : fixed) : fixed := match n with O => f | S n' => squares n' (mulF f f) end.
Definition vanishing : Z := 180 * unit_of_fixed.
(** e^-x for x >= 0, as (1 / e^(x / 4096))^4096; the series up to 180, and from there nearly 0. *)
Definition exp_by_series (x : fixed) : fixed :=
  let sum := exp_series 32 1 (Z.shiftr (fst x) 12, ceil_shift (snd x) 12) oneF oneF in
  squares 12 (divF oneF (fst sum, snd sum + 1)).
Definition exp_of_minus (x : fixed) : fixed :=
  if vanishing <=? fst x then (0, 1)
  else if vanishing <=? snd x then (0, snd (exp_by_series (fst x, vanishing)))
  else exp_by_series x.

Open Scope R_scope.
(** 2^256, sealed: a kernel that compares terms must not multiply it out. *)
Lemma sealed_unit : { u : R | u = powerRZ 2 256 }. Proof. eexists. reflexivity. Qed.
Definition U : R := proj1_sig sealed_unit.
Lemma U_is : powerRZ 2 256 = U. Proof. symmetry. exact (proj2_sig sealed_unit). Qed.
Definition inside (f : fixed) (x : R) : Prop := IZR (fst f) <= x * U <= IZR (snd f).

Lemma U_positive : 0 < U. Proof. rewrite <- U_is. apply power_pos. Qed.
Lemma power_integer n : (0 <= n)%Z -> powerRZ 2 n = IZR (2 ^ n).
Proof. intros H. rewrite <- (Z2Nat.id n) by auto. now rewrite <- pow_powerRZ, <- pow_IZR. Qed.
Lemma U_integer : IZR unit_of_fixed = U.
Proof. rewrite <- U_is. unfold unit_of_fixed. rewrite Z.shiftl_mul_pow2, power_integer by lia. f_equal. Qed.
Lemma least_min a b : IZR (least a b) <= IZR a /\ IZR (least a b) <= IZR b.
Proof. unfold least. destruct (Z.leb_spec a b); split; apply IZR_le; lia. Qed.
Lemma greatest_max a b : IZR a <= IZR (greatest a b) /\ IZR b <= IZR (greatest a b).
Proof. unfold greatest. destruct (Z.leb_spec a b); split; apply IZR_le; lia. Qed.
Lemma quotient_below a b : (0 < b)%Z -> IZR (a / b) * IZR b <= IZR a.
Proof. intros H. rewrite <- mult_IZR. apply IZR_le. pose proof (Z.mul_div_le a b H). lia. Qed.
Lemma quotient_above a b : (0 < b)%Z -> IZR a <= IZR (ceil_quotient a b) * IZR b.
Proof.
  intros H. unfold ceil_quotient. pose proof (quotient_below (- a) b H). rewrite !opp_IZR in *. lra.
Qed.
Lemma shift_below a n : (0 <= n)%Z -> IZR (Z.shiftr a n) * powerRZ 2 n <= IZR a.
Proof.
  intros H. rewrite Z.shiftr_div_pow2, power_integer by auto. apply quotient_below. now apply Z.pow_pos_nonneg.
Qed.
Lemma shift_above a n : (0 <= n)%Z -> IZR a <= IZR (ceil_shift a n) * powerRZ 2 n.
Proof. intros H. unfold ceil_shift. pose proof (shift_below (- a) n H). rewrite !opp_IZR in *. lra. Qed.
Lemma IZR_shiftl a n : (0 <= n)%Z -> IZR (Z.shiftl a n) = IZR a * powerRZ 2 n.
Proof. intros H. rewrite Z.shiftl_mul_pow2, mult_IZR, power_integer by auto. reflexivity. Qed.

Lemma floor_at_below u x : IZR (floor_at u x) * powerRZ 2 u <= real x.
Proof.
  unfold floor_at, real. assert (powerRZ 2 (snd x) = powerRZ 2 (snd x - u) * powerRZ 2 u) as E.
  { rewrite <- powerRZ_add by apply two_neq. f_equal. lia. }
  rewrite E. destruct (Z.leb_spec 0 (snd x - u)) as [L|L].
  - rewrite IZR_shiftl by auto. lra.
  - rewrite <- Rmult_assoc. apply Rmult_le_compat_r; [left; apply power_pos|].
    pose proof (shift_below (fst x) (- (snd x - u)) ltac:(lia)) as S.
    assert (powerRZ 2 (- (snd x - u)) * powerRZ 2 (snd x - u) = 1) as I.
    { rewrite <- powerRZ_add by apply two_neq. replace (- (snd x - u) + (snd x - u))%Z with 0%Z by lia. reflexivity. }
    apply (Rmult_le_compat_r (powerRZ 2 (snd x - u))) in S; [|left; apply power_pos].
    rewrite Rmult_assoc, I in S. lra.
Qed.
Lemma ceil_at_above u x : real x <= IZR (ceil_at u x) * powerRZ 2 u.
Proof. unfold ceil_at. pose proof (floor_at_below u (neg x)) as H. rewrite opp_IZR, real_neg in *. lra. Qed.
Lemma floor_to_below u x : real (floor_to u x) <= real x.
Proof. unfold floor_to. destruct (Z.leb_spec u (snd x)); [lra|]. apply floor_at_below. Qed.
Lemma ceil_to_above u x : real x <= real (ceil_to u x).
Proof. unfold ceil_to. destruct (Z.leb_spec u (snd x)); [lra|]. apply ceil_at_above. Qed.
Lemma unit_inverse : powerRZ 2 (-256) * U = 1.
Proof. rewrite <- U_is, <- powerRZ_add by apply two_neq. reflexivity. Qed.
Lemma inside_dyadic x : inside (of_dyadic x) (real x).
Proof.
  unfold inside, of_dyadic. simpl fst. simpl snd. pose proof (floor_at_below (-256) x).
  pose proof (ceil_at_above (-256) x).
  pose proof U_positive. pose proof unit_inverse as I.
  split; [apply (Rmult_le_compat_r U) in H|apply (Rmult_le_compat_r U) in H0]; try lra; rewrite Rmult_assoc, I in *;
    lra.
Qed.
Lemma inside_ends f x : inside f x -> real (fst f, -256)%Z <= x <= real (snd f, -256)%Z.
Proof.
  intros [H G]. unfold real. simpl fst. simpl snd. pose proof (power_pos (-256)). pose proof unit_inverse as I.
  apply (Rmult_le_compat_r (powerRZ 2 (-256))) in H, G; try lra. rewrite Rmult_assoc, (Rmult_comm U), I in *. lra.
Qed.
Lemma inside_one : inside oneF 1. Proof. unfold inside, oneF. simpl. rewrite U_integer. lra. Qed.
Lemma inside_add a b x y : inside a x -> inside b y -> inside (addF a b) (x + y).
Proof. unfold inside, addF. simpl. rewrite !plus_IZR. lra. Qed.
Lemma inside_neg a x : inside a x -> inside (negF a) (- x).
Proof. unfold inside, negF. simpl. rewrite !opp_IZR. lra. Qed.
Lemma inside_over a n x : (0 < n)%Z -> inside a x -> inside (overF a n) (x / IZR n).
Proof.
  unfold inside, overF. simpl. intros P [H G]. assert (0 < IZR n) as Q by (now apply (IZR_lt 0)).
  pose proof (quotient_below (fst a) n P). pose proof (quotient_above (snd a) n P).
  assert (x / IZR n * U * IZR n = x * U) as E by (field; lra).
  split; apply (Rmult_le_reg_r (IZR n)); lra.
Qed.
Lemma inside_ratio n d : (0 < d)%Z -> inside (ratioF n d) (IZR n / IZR d).
Proof.
  unfold inside, ratioF. cbn [fst snd]. intros P. assert (0 < IZR d) as Q by (now apply (IZR_lt 0)).
  pose proof (quotient_below (Z.shiftl n 256) d P) as A. pose proof (quotient_above (Z.shiftl n 256) d P) as B.
  rewrite IZR_shiftl, U_is in A, B by lia.
  assert (IZR n / IZR d * U * IZR d = IZR n * U) as E by (field; lra).
  split; apply (Rmult_le_reg_r (IZR d)); lra.
Qed.
Lemma product_between a b c d p q : a <= p <= b -> c <= q <= d -> forall l h,
  l <= a * c -> l <= a * d -> l <= b * c -> l <= b * d -> a * c <= h -> a * d <= h -> b * c <= h -> b * d <= h ->
  l <= p * q <= h.
Proof.
  intros [A B] [C D] l h. intros.
  assert (forall r, l <= r * c -> l <= r * d -> r * c <= h -> r * d <= h -> l <= r * q <= h) as L
    by (intros r; destruct (Rle_dec 0 r); intros; split; nra).
  pose proof (L a ltac:(auto) ltac:(auto) ltac:(auto) ltac:(auto)).
  pose proof (L b ltac:(auto) ltac:(auto) ltac:(auto) ltac:(auto)).
  destruct (Rle_dec 0 q); split; nra.
Qed.
Lemma inside_mul a b x y : inside a x -> inside b y -> inside (mulF a b) (x * y).
Proof.
  destruct a as [l h], b as [m k]. unfold inside, mulF. cbn [fst snd]. intros A B. pose proof U_positive as P.
  set (p := (l * m)%Z). set (q := (l * k)%Z). set (r := (h * m)%Z). set (s := (h * k)%Z).
  pose proof (least_min p q). pose proof (least_min r s). pose proof (least_min (least p q) (least r s)).
  pose proof (greatest_max p q). pose proof (greatest_max r s).
  pose proof (greatest_max (greatest p q) (greatest r s)).
  set (lo := least (least p q) (least r s)) in *. set (hi := greatest (greatest p q) (greatest r s)) in *.
  assert (IZR lo <= x * U * (y * U) <= IZR hi) as [L G].
  { apply (product_between _ _ _ _ _ _ A B); rewrite <- mult_IZR; fold p q r s; lra. }
  pose proof (shift_below lo 256 ltac:(lia)). pose proof (shift_above hi 256 ltac:(lia)). rewrite U_is in *.
  split; apply (Rmult_le_reg_r U); lra.
Qed.
Lemma inside_div a b x y : inside a x -> inside b y -> 1 <= y -> inside (divF a b) (x / y).
Proof.
  unfold inside, divF. cbn [fst snd]. intros [A B] [C D] Y. pose proof U_positive as P.
  set (m := greatest unit_of_fixed (fst b)). set (k := greatest unit_of_fixed (snd b)).
  assert (IZR m <= y * U) as M.
  { unfold m, greatest. destruct (Z.leb_spec unit_of_fixed (fst b)); [lra|]. rewrite U_integer. nra. }
  assert (y * U <= IZR k) as K by (unfold k; pose proof (greatest_max unit_of_fixed (snd b)); lra).
  assert (0 < m /\ 0 < k)%Z as [Pm Pk].
  { split; apply lt_IZR; [unfold m|unfold k];
      pose proof (greatest_max unit_of_fixed (fst b)); pose proof (greatest_max unit_of_fixed (snd b));
      rewrite U_integer in *; lra. }
  assert (0 < IZR m) by now apply (IZR_lt 0). assert (0 < IZR k) by now apply (IZR_lt 0).
  set (z := x / y). assert (z * (y * U) = x * U) as E by (unfold z; field; lra).
  set (l := Z.shiftl (fst a) 256). set (h := Z.shiftl (snd a) 256).
  assert (IZR l = IZR (fst a) * U) as El by (unfold l; rewrite IZR_shiftl, U_is by lia; reflexivity).
  assert (IZR h = IZR (snd a) * U) as Eh by (unfold h; rewrite IZR_shiftl, U_is by lia; reflexivity).
  assert (IZR l <= z * U * (y * U)) as L by (rewrite El; apply (Rmult_le_compat_r U) in A; [|lra]; nra).
  assert (z * U * (y * U) <= IZR h) as G by (rewrite Eh; apply (Rmult_le_compat_r U) in B; [|lra]; nra).
  split.
  - destruct (Z.leb_spec 0 l) as [S|S].
    + pose proof (quotient_below l k Pk) as Q. apply IZR_le in S. apply (Rmult_le_reg_r (IZR k)); auto.
      assert (0 <= z * U) by nra. nra.
    + pose proof (quotient_below l m Pm) as Q. apply IZR_lt in S.
      destruct (Rle_lt_dec 0 (z * U)) as [T|T]; [|apply (Rmult_le_reg_r (IZR m)); nra].
      assert (IZR (l / m) <= 0) by nra. lra.
  - destruct (Z.leb_spec 0 h) as [S|S].
    + pose proof (quotient_above h m Pm) as Q. apply IZR_le in S.
      destruct (Rle_lt_dec 0 (z * U)) as [T|T]; [apply (Rmult_le_reg_r (IZR m)); nra|].
      assert (0 <= IZR (ceil_quotient h m)) by nra. lra.
    + pose proof (quotient_above h k Pk) as Q. apply IZR_lt in S. apply (Rmult_le_reg_r (IZR k)); auto.
      assert (z * U < 0) by nra. nra.
Qed.
Lemma inside_wider a x l h : inside a x -> (l <= fst a)%Z -> (snd a <= h)%Z -> inside (l, h) x.
Proof. unfold inside. simpl. intros A L H. apply IZR_le in L, H. lra. Qed.

(** The series of e^y ends with y^32 / 32!. *)
Definition exp_term (y : R) (k : nat) : R := / INR (fact k) * y ^ k.
Lemma term_after y k : exp_term y (S k) = exp_term y k * y / INR (S k).
Proof.
  unfold exp_term. rewrite fact_simpl, mult_INR. simpl pow. pose proof (INR_fact_neq_0 k).
  pose proof (not_0_INR (S k) ltac:(lia)). field. auto.
Qed.
Lemma term_nonneg y k : 0 <= y -> 0 <= exp_term y k.
Proof.
  intros H. apply Rmult_le_pos; [|now apply pow_le]. left. apply Rinv_0_lt_compat, lt_0_INR, lt_O_fact.
Qed.
Lemma term_halves y k : 0 <= y <= / 2 -> 2 * exp_term y (S k) <= exp_term y k.
Proof.
  intros H. rewrite term_after. pose proof (term_nonneg y k (proj1 H)) as T.
  assert (1 <= INR (S k)) by (apply (le_INR 1); lia). apply (Rmult_le_reg_r (INR (S k))); [lra|].
  replace (2 * (exp_term y k * y / INR (S k)) * INR (S k)) with (exp_term y k * (2 * y)) by (field; lra).
  apply Rmult_le_compat_l; lra.
Qed.
Lemma exp_above_series y n : 0 <= y -> E1 y n <= exp y.
Proof.
  intros H. apply (growing_ineq (E1 y)); [|apply E1_cvg]. intros k. unfold E1. rewrite tech5.
  pose proof (term_nonneg y (S k) H) as T. unfold exp_term in T. lra.
Qed.
Lemma exp_below_series y n : 0 <= y <= / 2 -> exp y <= E1 y n + 2 * exp_term y (S n).
Proof.
  intros H. apply (limit_below (fun m => E1 y (n + m))); [apply shifted, E1_cvg|].
  intros m. enough (E1 y (n + m) + 2 * exp_term y (S (n + m)) <= E1 y n + 2 * exp_term y (S n))
    by (pose proof (term_nonneg y (S (n + m)) (proj1 H)); lra).
  induction m as [|m IH]; [rewrite Nat.add_0_r; lra|]. rewrite Nat.add_succ_r.
  pose proof (term_halves y (S (n + m)) H). replace (E1 y (S (n + m))) with (E1 y (n + m) + exp_term y (S (n + m)))
    by (unfold E1, exp_term; reflexivity). lra.
Qed.
Fixpoint factorial (n : nat) : Z := match n with O => 1%Z | S m => (Z.of_nat (S m) * factorial m)%Z end.
Lemma factorial_fact n : INR (fact n) = IZR (factorial n).
Proof.
  induction n as [|n IH]; [reflexivity|]. rewrite fact_simpl, mult_INR, IH, INR_IZR_INZ.
  change (factorial (S n)) with (Z.of_nat (S n) * factorial n)%Z. now rewrite mult_IZR.
Qed.
Lemma starts_at_one y : exp_term y 0 = 1 /\ E1 y 0 = 1.
Proof. unfold exp_term, E1. simpl. rewrite Rinv_1. lra. Qed.
Lemma next_sum y k : E1 y (S k) = E1 y k + exp_term y (S k). Proof. reflexivity. Qed.
#[local] Opaque fact factorial E1.
Lemma below_a_unit p n d f : (0 < d)%Z -> (0 < f)%Z -> (2 * n * unit_of_fixed <= f * d)%Z -> p <= IZR n / IZR d ->
  2 * (/ IZR f * p) <= / U.
Proof.
  intros D F H P. pose proof U_positive. apply (IZR_lt 0) in D, F. apply IZR_le in H.
  rewrite !mult_IZR, U_integer in H. pose proof (Rinv_0_lt_compat _ F).
  apply Rle_trans with (2 * (/ IZR f * (IZR n / IZR d))); [nra|].
  apply (Rmult_le_reg_r (U * (IZR f * IZR d))); [apply Rmult_lt_0_compat; nra|].
  replace (/ U * (U * (IZR f * IZR d))) with (IZR f * IZR d) by (field; lra).
  replace (2 * (/ IZR f * (IZR n / IZR d)) * (U * (IZR f * IZR d))) with (2 * IZR n * U) by (field; lra). lra.
Qed.
Lemma exp_by_32_terms y : 0 <= y <= 180 / 4096 -> E1 y 32 <= exp y <= E1 y 32 + / U.
Proof.
  intros H. split; [apply exp_above_series; lra|]. pose proof (exp_below_series y 32 ltac:(lra)) as B.
  apply Rle_trans with (1 := B), Rplus_le_compat_l. unfold exp_term. rewrite factorial_fact.
  apply below_a_unit with (n := (45 ^ 33)%Z) (d := (1024 ^ 33)%Z); [reflexivity|now vm_compute|now vm_compute|].
  apply Rle_trans with ((45 / 1024) ^ 33); [apply pow_incr; lra|].
  unfold Rdiv. rewrite Rpow_mult_distr, pow_inv, !pow_IZR. right. reflexivity.
Qed.
Lemma inside_series n y b term sum k : inside y b -> inside term (exp_term b k) -> inside sum (E1 b k) ->
  inside (exp_series n (Z.of_nat (S k)) y term sum) (E1 b (k + n)).
Proof.
  intros Hy. revert term sum k. induction n as [|n IH]; intros term sum k Ht Hs; cbn [exp_series].
  - now rewrite Nat.add_0_r.
  - rewrite Nat.add_succ_r, <- Nat.add_succ_l. replace (Z.of_nat (S k) + 1)%Z with (Z.of_nat (S (S k))) by lia.
    assert (inside (overF (mulF term y) (Z.of_nat (S k))) (exp_term b (S k))) as T.
    { rewrite term_after. rewrite INR_IZR_INZ. apply inside_over; [lia|]. now apply inside_mul. }
    apply IH; auto. rewrite next_sum. now apply inside_add.
Qed.
Lemma inside_32_terms y b : inside y b -> inside (exp_series 32 1 y oneF oneF) (E1 b 32).
Proof.
  intros H. destruct (starts_at_one b) as [T0 E0].
  apply (inside_series 32 y b oneF oneF 0 H); rewrite ?T0, ?E0; apply inside_one.
Qed.
Lemma inside_squares n f x : inside f x -> inside (squares n f) (x ^ (2 ^ n)).
Proof.
  revert f x. induction n as [|n IH]; intros f x H; [now rewrite Nat.pow_0_r, pow_1|].
  cbn [squares]. replace (x ^ 2 ^ S n) with ((x * x) ^ 2 ^ n); [apply IH; now apply inside_mul|].
  rewrite Nat.pow_succ_r', pow_mult. f_equal. ring.
Qed.
Lemma exp_multiple n x : exp x ^ n = exp (INR n * x).
Proof.
  induction n as [|n IH]; [simpl; now rewrite Rmult_0_l, exp_0|].
  rewrite S_INR, Rmult_plus_distr_r, Rmult_1_l, exp_plus, <- IH. simpl. ring.
Qed.
Lemma doubled_12_times b : (1 / exp b) ^ (2 ^ 12) = exp (- (4096 * b)).
Proof.
  pose proof (exp_opp b) as O. pose proof (exp_pos b). replace (1 / exp b) with (exp (- b)) by (rewrite <- O; field;
    lra).
  rewrite exp_multiple, pow_INR. f_equal. simpl pow. simpl INR. ring.
Qed.
Lemma exp_180 : exp (- (180)) <= / U.
Proof.
  assert (2 <= exp (45 / 64)) as H.
  { replace (45 / 64) with (2 * (2 * (45 / 256))) by field.
    apply exp_double with (a := 1416 / 1000); [lra| |lra]. apply exp_double with (a := 11912 / 10000); [lra| |lra].
    pose proof (exp_square (45 / 256)). lra. }
  assert (U <= exp 180) as G.
  { replace 180 with (IZR (Z.of_nat 256) * (45 / 64)) by (simpl; field). rewrite <- INR_IZR_INZ, <- exp_multiple.
    rewrite <- U_is. change 256%Z with (Z.of_nat 256). rewrite <- pow_powerRZ. apply pow_incr. lra. }
  pose proof (exp_opp 180). pose proof U_positive. apply (Rmult_le_reg_l U); auto. rewrite Rinv_r by lra.
  pose proof (exp_pos (- (180))). nra.
Qed.
Lemma inside_exp_by_series x a : inside x a -> 0 <= a <= 180 -> inside (exp_by_series x) (exp (- a)).
Proof.
  intros [L H] A. unfold exp_by_series. set (b := a / 4096). assert (0 <= b <= 180 / 4096) as B by (unfold b; lra).
  assert (powerRZ 2 12 = 4096) as Two by (rewrite power_integer by lia; reflexivity).
  set (y := (Z.shiftr (fst x) 12, ceil_shift (snd x) 12)).
  assert (inside y b) as Y.
  { unfold inside, y. cbn [fst snd]. pose proof (shift_below (fst x) 12 ltac:(lia)).
    pose proof (shift_above (snd x) 12 ltac:(lia)). rewrite Two in *. unfold b. lra. }
  pose proof (inside_32_terms y b Y) as S. generalize dependent (exp_series 32 1 y oneF oneF). intros sum [S1 S2].
  destruct (exp_by_32_terms b B) as [E F]. pose proof U_positive as P.
  assert (inside (fst sum, snd sum + 1)%Z (exp b)) as W.
  { unfold inside. cbn [fst snd]. rewrite plus_IZR. apply (Rmult_le_compat_r U) in E, F; try lra.
    rewrite Rmult_plus_distr_r, Rinv_l in F by lra. lra. }
  assert (1 <= exp b) as One by (pose proof (exp_above_line b); lra).
  pose proof (inside_squares 12 _ _ (inside_div _ _ _ _ inside_one W One)) as Q.
  rewrite doubled_12_times in Q. now replace (4096 * b) with a in Q by (unfold b; field).
Qed.
Lemma vanishing_integer : IZR vanishing = 180 * U.
Proof. unfold vanishing. now rewrite mult_IZR, U_integer. Qed.
#[local] Opaque exp_by_series vanishing.
Lemma inside_far x a : (vanishing <= fst x)%Z -> inside x a -> inside (0, 1)%Z (exp (- a)).
Proof.
  intros G [L H]. apply IZR_le in G. rewrite vanishing_integer in G. pose proof U_positive as P.
  assert (180 <= a) by (apply (Rmult_le_reg_r U); lra). pose proof exp_180 as V. pose proof (exp_pos (- a)).
  unfold inside. cbn [fst snd]. split; [nra|]. apply Rle_trans with (/ U * U); [|right; field; lra].
  apply Rmult_le_compat_r; [lra|]. pose proof (exp_rises (- a) (- (180)) ltac:(lra)). lra.
Qed.
Lemma inside_below f a c : c <= a -> inside f (exp (- c)) -> inside (0, snd f)%Z (exp (- a)).
Proof.
  intros L [_ Q]. unfold inside. cbn [fst snd]. pose proof (exp_rises (- a) (- c) ltac:(lra)). pose proof U_positive.
  pose proof (exp_pos (- a)). split; [nra|]. apply Rle_trans with (2 := Q). apply Rmult_le_compat_r; lra.
Qed.
Lemma inside_up_to_180 x a : (fst x < vanishing <= snd x)%Z -> inside x a -> 0 <= a ->
  inside (0, snd (exp_by_series (fst x, vanishing)))%Z (exp (- a)).
Proof.
  intros [G _] [L H] A. apply IZR_lt in G. pose proof vanishing_integer as Ev. pose proof U_positive as P.
  destruct (Rle_dec a 180) as [S|S]; [apply (inside_below _ a a)|apply (inside_below _ a 180)]; try lra;
    apply inside_exp_by_series; try lra; unfold inside; cbn [fst snd]; rewrite Ev in *; nra.
Qed.
Theorem inside_exp x a : inside x a -> 0 <= a -> inside (exp_of_minus x) (exp (- a)).
Proof.
  intros I A. unfold exp_of_minus.
  destruct (Z.leb_spec vanishing (fst x)) as [F|F]; [now apply (inside_far x)|].
  destruct (Z.leb_spec vanishing (snd x)) as [T|T]; [now apply inside_up_to_180|].
  apply inside_exp_by_series; auto. split; auto. destruct I as [_ H]. apply IZR_lt in T. rewrite vanishing_integer in T.
  apply (Rmult_le_reg_r U); [apply U_positive|lra].
Qed.
